/** What the page says when something is wrong. */

import { readFileSync } from "node:fs";
import { join } from "node:path";

export const PATIENCE = 60_000;

/** All the sentences in sight above the page. */
const sentences = async (page) => (await page.locator("body > p:visible").allInnerTexts()).join(" | ");

/** What a page ends with some of whose files answer otherwise; null as an answer: no connection. */
async function failing(browser, address, { answers = {}, before, until = "body[data-state=failed]" } = {}) {
  const page = await (await browser.newContext({ serviceWorkers: "block" })).newPage();
  for (const [file, answer] of Object.entries(answers)) {
    await page.route(`**/${file}`, (route) => (answer ? route.fulfill(answer) : route.abort()));
  }
  if (before) await page.addInitScript(before);
  await page.goto(address);
  await page.waitForSelector(until, { timeout: PATIENCE });
  const said = await sentences(page);
  await page.context().close();
  return said;
}

/** What a page says none of whose scripts runs. */
async function still(browser, address, options) {
  const page = await (await browser.newContext({ serviceWorkers: "block", ...options })).newPage();
  await page.goto(address);
  const said = await sentences(page);
  await page.context().close();
  return said;
}

/** The sentence for each trouble, by name; `plain` is a browser without WebAssembly. */
export async function troubles({ browser, plain, base, origin, dist }) {
  const gone = { status: 404, body: "" };
  const nonsense = { status: 200, body: "<html>not what was asked for</html>" };
  const cut = JSON.parse(readFileSync(join(dist, "solids.json"), "utf8"));
  cut.curves.at(-1).force.pop();
  const answering = (file, answer) => failing(browser, base, { answers: { [file]: answer } });
  const said = "#message:not([hidden])";
  /** Without a file of `fast`, or of the contact, the page stays. */
  const staying = (file, answer) => failing(browser, base, { answers: { [file]: answer }, until: said });
  const paper = (file, answer, chosen = browser) =>
    failing(chosen, `${base}#model=M1-concat`, { answers: file ? { [file]: answer } : {}, until: said });
  return {
    missingFast: await staying("fast.bin", gone),
    noFast: await staying("fast.bin", nonsense),
    missingContact: await staying("contact-paper-4.json", gone),
    missing: await paper("model.onnx", gone),
    unreachable: await paper("model.onnx", null),
    notOnnx: await paper("model.onnx", nonsense),
    // The prefix of a protocol buffer: ir_version 8, no metadata.
    foreignOnnx: await paper("model.onnx", { status: 200, body: Buffer.from([0x08, 0x08]) }),
    missingPaperCurves: await paper("curves.json", gone),
    missingRuntime: await paper("ort.wasm", gone),
    badRuntime: await paper("ort.wasm", nonsense),
    noWebAssembly: await paper(undefined, undefined, plain),
    missingCurves: await answering("solids.json", gone),
    noJson: await answering("solids.json", nonsense),
    noCurves: await answering("solids.json", { status: 200, body: "null" }),
    cutCurves: await answering("solids.json", { status: 200, body: JSON.stringify(cut) }),
    missingScript: await failing(browser, `${origin}no-main/`),
    badScript: await answering("main.js", { status: 200, contentType: "text/javascript", body: "static {" }),
    // A browser without modules has no such property, and leaves main.js alone.
    noModules: await failing(browser, base, {
      answers: { "main.js": null },
      before: () => delete HTMLScriptElement.prototype.noModule,
    }),
    file: await failing(browser, `file://${join(dist, "index.html")}`),
    noScript: await still(browser, base, { javaScriptEnabled: false }),
    noBoot: await still(browser, `${origin}no-boot/`),
  };
}
