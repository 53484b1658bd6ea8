/**
 * Puts the page's modules together for pages that are one file; `page_tools.py bundle` runs it. The map's library is not in it: it stands once
 * in `vendor`, and is put beside this by `mavlink_bridge/console/one_file.py`.
 */

import { build } from "esbuild";

const [entry, banner] = process.argv.slice(2);

const library = {
  name: "the map's library stands in the file already",
  setup(found) {
    found.onResolve({ filter: /maplibre-gl\.mjs$/ }, () => ({ path: "maplibre", namespace: "inside" }));
    found.onLoad({ filter: /.*/, namespace: "inside" }, () => ({ contents: "module.exports = globalThis.maplibre;", loader: "js" }));
  },
};

const { outputFiles } = await build({
  entryPoints: [entry], bundle: true, format: "esm", target: "es2022", minify: true, charset: "utf8", legalComments: "none",
  banner: { js: banner }, plugins: [library], write: false, logLevel: "warning",
});
process.stdout.write(outputFiles[0].contents);
