/** The choices of axes and units, and the contact of the laboratory units. */

import { USUAL_VIEW, type View } from "./axes";
import { CONTACT, USUAL_CONTACT, type Contact } from "./units";

const byId = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

export class ViewControls {
  view: View = USUAL_VIEW;
  contact: Contact = { ...USUAL_CONTACT };

  constructor(changed: () => void) {
    for (const axis of Object.keys(USUAL_VIEW)) {
      for (const input of document.querySelectorAll<HTMLInputElement>(`input[name=${axis}]`)) {
        input.addEventListener("change", () => {
          this.view = { ...this.view, [axis]: input.value } as View;
          changed();
        });
      }
    }
    for (const name of CONTACT) {
      const box = byId<HTMLInputElement>(name);
      box.addEventListener("input", () => {
        const value = box.valueAsNumber * Number(box.dataset["scale"]);
        const usable = value > 0 && Number.isFinite(value);
        box.setAttribute("aria-invalid", String(!usable));
        if (!usable) return;
        this.contact = { ...this.contact, [name]: value };
        changed();
      });
    }
  }

  /** Show a view and a contact without announcing them. */
  show(view: View, contact: Contact): void {
    this.view = view;
    this.contact = contact;
    for (const [axis, value] of Object.entries(view)) {
      document.querySelector<HTMLInputElement>(`input[name=${axis}][value=${value}]`)!.checked = true;
    }
    for (const name of CONTACT) {
      const box = byId<HTMLInputElement>(name);
      box.value = String(Number((contact[name] / Number(box.dataset["scale"])).toPrecision(6)));
    }
  }
}
