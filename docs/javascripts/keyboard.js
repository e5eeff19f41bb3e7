// What the theme leaves out for those who use keyboard or screen reader: the name of the search, and the focus of
// what is wider than the page, which arrows then scroll.
const WIDE = ".md-typeset__scrollwrap, .rendered_html, .md-typeset pre > code, math[display=block]";
document$.subscribe(() => {
  document.querySelector("[data-md-component=search]").setAttribute("aria-label", "Search");
  requestAnimationFrame(() => {
    for (const element of document.querySelectorAll(WIDE)) {
      if (element.scrollWidth > element.clientWidth) element.tabIndex = 0;
    }
  });
});
