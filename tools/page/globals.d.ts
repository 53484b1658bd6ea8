/** PMTiles as its classic script leaves it, loaded only where there is a map (`tiles.js`). */
declare const pmtiles: {
  Protocol: new () => { tile: (request: { url: string; type?: string }, abort: AbortController) => Promise<{ data: unknown }> };
};
