// Notes from which sources the page was built, so that a test can tell whether it still is.
import { createHash } from "node:crypto";
import { readdirSync, readFileSync, writeFileSync } from "node:fs";

const hash = createHash("sha256");
for (const name of readdirSync("src").sort()) hash.update(`${name}\0`).update(readFileSync(`src/${name}`)).update("\0");
writeFileSync("../src/bellcrank/web/static/sources.sha256", `${hash.digest("hex")}\n`);
