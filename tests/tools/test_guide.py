import pytest
from mkdocs.exceptions import PluginError

from tools import guide


def test_the_wrong_second_address_of_a_picture_is_removed():
    written = '<img alt="a" class="one" src="images/a.png" srcset="../images/a.png" />'
    assert guide.on_page_content(written) == '<img alt="a" class="one" src="images/a.png" />'


def test_a_word_of_code_is_not_broken_at_its_hyphens_but_a_block_is_left_alone():
    written = "<p><code>make docs-cost</code></p><pre><code>make docs-cost</code></pre><code>plain words</code>"
    found = guide.on_page_content(written)
    assert found == written.replace("docs-cost", '<span class="whole">docs-cost</span>', 1)
    long = f"<code>--{'a-' * 20}</code>"
    assert guide.on_page_content(long) == long


def test_a_point_stays_with_the_formula_before_it():
    inline, block = "<math><mi>P</mi></math>", '<math display="block"><mi>P</mi></math>'
    assert guide.on_page_content(f"{inline}, {inline} and {block}.") == (
        f'<span class="whole">{inline},</span> {inline} and {block}.'
    )


@pytest.mark.parametrize(
    "image",
    ['src="images/none.png"', 'src="images/a.png" srcset="../images/a.png"', 'src="images/a.png" srcset="b.png 2x"'],
)
def test_a_missing_picture_fails_the_build(tmp_path, image):
    (tmp_path / "gallery/images").mkdir(parents=True)
    (tmp_path / "gallery/images/a.png").touch()
    (tmp_path / "gallery/page.html").write_text(f"<p><img {image}></p>")
    with pytest.raises(PluginError, match=r"page\.html: the picture .*png is missing"):
        guide.on_post_build({"site_dir": str(tmp_path)})


def test_pictures_that_exist_or_lie_elsewhere_pass(tmp_path):
    (tmp_path / "a b.png").touch()
    (tmp_path / "page.html").write_text(
        '<img src="a%20b.png" srcset="a%20b.png 1x, a%20b.png 2x"><img src="https://example.org/c.png">'
        '<img src="data:image/png;base64,AA,BB">'
    )
    guide.on_post_build({"site_dir": str(tmp_path)})
