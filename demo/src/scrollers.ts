/** Boxes that scroll sideways where the window is narrow. */

/** Let the keyboard reach a box while it has something to scroll, so that the arrows can move it. */
export function reachable(box: HTMLElement): void {
  const update = () => {
    if (box.scrollWidth > box.clientWidth) box.tabIndex = 0;
    else box.removeAttribute("tabindex");
  };
  new ResizeObserver(update).observe(box);
}
