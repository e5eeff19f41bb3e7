import pytest
from mkdocs.exceptions import PluginError

from tools import guide


def test_pages_are_mended():
    written = '<img alt="a" class="one" src="images/a.png" srcset="../images/a.png" />'
    assert guide.on_page_content(written) == '<img alt="a" class="one" src="images/a.png" />'
    written = "<p><code>make docs-cost</code></p><pre><code>make docs-cost</code></pre><code>plain words</code>"
    found = guide.on_page_content(written)
    assert found == written.replace("docs-cost", '<span class="whole">docs-cost</span>', 1)
    long = f"<code>--{'a-' * 20}</code>"
    assert guide.on_page_content(long) == long
    inline, block = "<math><mi>P</mi></math>", '<math display="block"><mi>P</mi></math>'
    assert guide.on_page_content(f"{inline}, {inline} and {block}.") == (
        f'<span class="whole">{inline},</span> {inline} and {block}.'
    )
    written = (
        '<a class="one" href="1_first"><a href="2_second#part"><a href="1.html"><a href="https://example.org/1_a">'
    )
    named = written.replace("1_first", "1_first.html").replace("2_second", "2_second.html")
    assert guide.on_page_content(written) == named


@pytest.mark.parametrize(
    "tag",
    [
        'img src="images/none.png"',
        'img src="images/a.png" srcset="../images/a.png"',
        'img src="images/a.png" srcset="b.png 2x"',
        'a href="1_first"',
        'a href="images/"',
        'link href="/none.css"',
    ],
)
def test_an_address_without_a_file_fails_the_build(tmp_path, tag):
    (tmp_path / "gallery/images").mkdir(parents=True)
    (tmp_path / "gallery/images/a.png").touch()
    (tmp_path / "gallery/1_first.html").touch()
    (tmp_path / "gallery/page.html").write_text(f"<p><{tag}></p>")
    with pytest.raises(PluginError, match=r"page\.html: \S+ is missing"):
        guide.on_post_build({"site_dir": str(tmp_path)})


def test_what_the_gallery_leaves_is_removed(tmp_path):
    for name in ("a.pickle", "b.py.md5", "broken_example.png", "no_image.png", "kept.png"):
        (tmp_path / name).touch()
    guide.on_post_build({"site_dir": str(tmp_path)})
    assert [path.name for path in tmp_path.iterdir()] == ["kept.png"]


def test_pictures_that_exist_or_lie_elsewhere_pass(tmp_path):
    (tmp_path / "a b.png").touch()
    (tmp_path / "index.html").touch()
    (tmp_path / "page.html").write_text(
        '<img src="a%20b.png" srcset="a%20b.png 1x, a%20b.png 2x"><img src="https://example.org/c.png">'
        '<img src="data:image/png;base64,AA,BB"><a href="#part"><a href="."><a href="/index.html?q=1">'
        '<a href="mailto:a@b">'
    )
    guide.on_post_build({"site_dir": str(tmp_path)})
