/** What goes wrong, told to the reader in one sentence where it is seen. */

/** An error whose message is such a sentence. */
export class Trouble extends Error {}

const place = () => document.getElementById("message")!;

export function tell(sentence: string): void {
  place().textContent = sentence;
  place().hidden = false;
}

/** Take back what was told. */
export function untell(): void {
  place().hidden = true;
}
