/** A static server, as any site has one: `python -m http.server`, the page below a sub-path. */

import { spawn } from "node:child_process";
import { mkdirSync, readdirSync, readFileSync, symlinkSync, writeFileSync } from "node:fs";
import { createServer } from "node:net";
import { dirname, join } from "node:path";

const SUB_PATH = "some/sub-path";

async function freePort() {
  const server = createServer();
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const { port } = server.address();
  await new Promise((resolve) => server.close(resolve));
  return port;
}

/** A copy of the page at another path of the same origin, from another build or lacking files. */
function copy(dist, place, { version, without = [] }) {
  mkdirSync(place);
  for (const file of readdirSync(dist).filter((name) => !without.includes(name))) {
    if (file !== "service-worker.js") {
      symlinkSync(join(dist, file), join(place, file));
    } else {
      const script = readFileSync(join(dist, file), "utf8");
      writeFileSync(join(place, file), script.replace(/VERSION = "\w+"/, `VERSION = "${version}"`));
    }
  }
}

/**
 * Serve the built page at `base`, and copies of it beside that path.
 *
 * @param root A folder to be made.
 */
export async function serve(root, dist, python) {
  mkdirSync(join(root, dirname(SUB_PATH)), { recursive: true });
  symlinkSync(dist, join(root, SUB_PATH));
  copy(dist, join(root, "a"), { version: "one" });
  copy(dist, join(root, "b"), { version: "other" });
  copy(dist, join(root, "no-main"), { version: "none", without: ["main.js"] });
  copy(dist, join(root, "no-boot"), { version: "none", without: ["main.js", "boot.js"] });
  const port = await freePort();
  const options = ["-m", "http.server", String(port), "--bind", "127.0.0.1", "--directory", root];
  const server = spawn(python, options, { stdio: "ignore" });
  const base = `http://127.0.0.1:${port}/${SUB_PATH}/`;
  for (let attempt = 0; ; attempt++) {
    try {
      await fetch(base);
      const gone = new Promise((resolve) => server.on("exit", resolve));
      return { base, origin: new URL("/", base).href, stop: () => server.kill() && gone };
    } catch (error) {
      if (attempt === 100) throw error;
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
  }
}
