/** Colours of the drawings: they come from the style sheet, which knows about dark mode. */

export function colours() {
  const style = getComputedStyle(document.documentElement);
  const of = (name: string) => style.getPropertyValue(`--${name}`).trim();
  return {
    paper: of("surface"),
    text: of("text"),
    muted: of("muted"),
    line: of("line"),
    band: of("band"),
    surrogate: of("surrogate"),
    uncertain: `${of("surrogate")}38`,
    solver: of("solver"),
    pinned: of("pinned"),
    peak: of("peak"),
    path: of("path"),
    sphere: of("sphere"),
    solid: of("solid"),
    push: of("push"),
    pull: of("pull"),
    font: getComputedStyle(document.body).fontFamily,
  };
}
export type Ink = ReturnType<typeof colours>;
