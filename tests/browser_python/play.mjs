// Plays the core as plain Python in Pyodide, as a browser does, and compares all bits with those of
// the Python that has written the shots:
//
//     node tests/browser_python/play.mjs shots.json PYODIDE PACKAGE MYPY_EXTENSIONS
//
// PYODIDE is the folder of the npm package, PACKAGE that of pool_pymunk, MYPY_EXTENSIONS a file.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [shots, home, pkg, extensions] = process.argv.slice(2);
const { loadPyodide } = await import(pathToFileURL(`${home}/pyodide.mjs`));
const pyodide = await loadPyodide();
pyodide.FS.mkdirTree("/pool/pool_pymunk");
pyodide.FS.mount(pyodide.FS.filesystems.NODEFS, { root: pkg }, "/pool/pool_pymunk");
pyodide.FS.writeFile("/pool/mypy_extensions.py", readFileSync(extensions));
pyodide.FS.writeFile("/pool/report_shots.py", readFileSync(new URL("report_shots.py", import.meta.url)));
const text = readFileSync(shots, "utf8");
pyodide.globals.set("text", text);
const [version, played] = pyodide.runPython(`
import os, sys
os.environ["POOL_PYMUNK_PURE"] = "1"
sys.dont_write_bytecode = True
sys.path.insert(0, "/pool")
import report_shots
sys.version.split()[0], report_shots.as_played(text)
`);
const wanted = JSON.parse(text).map((shot) => shot.became);
let failed = 0;
JSON.parse(played).forEach(([events, knots], k) => {
  const same = JSON.stringify([events, knots]) === JSON.stringify(wanted[k]);
  if (!same) failed += 1;
  console.log(`shot ${k + 1}: ${events.length} events, ${same ? "same bits" : "OTHER BITS"}`);
});
const done = wanted.length - failed;
console.log(`Pyodide, Python ${version}: ${done} passed, ${failed} failed`);
process.exit(failed > 0 || done === 0 ? 1 : 0);
