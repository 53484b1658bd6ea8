/** Raster tiles under everything: out of one PMTiles file, or one by one from an address with {z}, {x} and {y}. */

import * as maplibre from "../vendor/maplibre-gl/maplibre-gl.mjs";

/**
 * @param {import("../types.js").MapSource | null} tiles
 * @returns {{source: any, attribution: string} | null}
 */
export function tileSource(tiles) {
  if (!tiles) {
    return null;
  }
  const url = new URL(tiles.url, document.baseURI).href;
  const source = tiles.kind === "pmtiles"
    ? { type: "raster", url: `pmtiles://${url}`, tileSize: 256 }
    : { type: "raster", tiles: [decodeURI(url)], tileSize: 256, maxzoom: 22 };
  return { source, attribution: tiles.attribution };
}

/**
 * Load what reads PMTiles; only where there are some.
 * @param {import("../types.js").MapSource | null} tiles
 * @returns {Promise<void>}
 */
export async function prepareTiles(tiles) {
  if (tiles?.kind !== "pmtiles") {
    return;
  }
  await new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = new URL("../vendor/pmtiles/pmtiles.js", import.meta.url).href;
    script.addEventListener("load", resolve);
    script.addEventListener("error", reject);
    document.head.append(script);
  });
  maplibre.addProtocol("pmtiles", /** @type {any} */ (new pmtiles.Protocol().tile));
}
