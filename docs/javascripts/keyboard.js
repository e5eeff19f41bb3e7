// What the theme leaves out for those who use keyboard or screen reader: the name of the search, and the focus of a
// wide table, which arrows then scroll.
document$.subscribe(() => {
  document.querySelector("[data-md-component=search]").setAttribute("aria-label", "Search");
  requestAnimationFrame(() => {
    for (const table of document.querySelectorAll(".md-typeset__scrollwrap, .rendered_html, .md-typeset pre > code")) {
      table.tabIndex = 0;
    }
  });
});
