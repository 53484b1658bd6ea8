/** The map's small pictures, drawn here: nothing is loaded for them. */

import { colours } from "./style.js";

/** @typedef {import("../vendor/maplibre-gl/maplibre-gl.mjs").Map} Map */

const RATIO = 2; // pixels of the picture for one of the map: sharp on fine screens

/** @type {Record<string, {size: number, draw: (pen: CanvasRenderingContext2D, colour: import("./style.js").Colours) => void}>} */
const ICONS = {
  hatch: { size: 12, draw: (pen, colour) => stripes(pen, 12, colour.hatch) },
  arrow: { size: 20, draw: (pen, colour) => shape(pen, [[5, 4], [16, 10], [5, 16]], colour.text, colour.halo, 1.5) },
  rover: { size: 36, draw: (pen, colour) => shape(pen, [[18, 3], [29, 32], [18, 26], [7, 32]], colour.rover, colour.roverEdge, 2.5) },
  "rover-lost": { size: 36, draw: lost },
  target: { size: 30, draw: (pen, colour) => ring(pen, 15, colour.target, colour.halo) },
  home: { size: 26, draw: (pen, colour) => shape(pen, [[13, 3], [23, 12], [20, 12], [20, 22], [6, 22], [6, 12], [3, 12]], colour.text, colour.halo, 2) },
  rally: { size: 26, draw: (pen, colour) => shape(pen, [[7, 23], [7, 4], [22, 9], [9, 14], [9, 23]], colour.fence, colour.halo, 2) },
  start: { size: 22, draw: (pen, colour) => shape(pen, [[5, 5], [17, 5], [17, 17], [5, 17]], colour.halo, colour.keeps, 3) },
  least: { size: 24, draw: (pen, colour) => shape(pen, [[12, 2], [22, 12], [12, 22], [2, 12]], colour.near, colour.text, 2) },
  blocked: { size: 28, draw: cross },
  event: { size: 18, draw: (pen, colour) => shape(pen, [[9, 2], [16, 15], [2, 15]], colour.near, colour.text, 1.5) },
};

/**
 * @param {Map} map
 * @param {boolean} isDark
 */
export function addIcons(map, isDark) {
  for (const [name, { size, draw }] of Object.entries(ICONS)) {
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = size * RATIO;
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { willReadFrequently: true }));
    pen.scale(RATIO, RATIO);
    draw(pen, colours(isDark));
    const picture = pen.getImageData(0, 0, canvas.width, canvas.height);
    if (map.hasImage(name)) {
      map.removeImage(name);
    }
    map.addImage(name, picture, { pixelRatio: RATIO });
  }
}

/**
 * @param {CanvasRenderingContext2D} pen
 * @param {number[][]} corners
 * @param {string} inside
 * @param {string} edge
 * @param {number} width
 */
function shape(pen, corners, inside, edge, width) {
  pen.beginPath();
  corners.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
  pen.closePath();
  pen.lineJoin = "round";
  pen.lineWidth = width * 2;
  pen.strokeStyle = edge;
  pen.stroke();
  pen.fillStyle = inside;
  pen.fill();
}

/**
 * @param {CanvasRenderingContext2D} pen
 * @param {number} size
 * @param {string} colour
 */
function stripes(pen, size, colour) {
  pen.strokeStyle = colour;
  pen.globalAlpha = 0.55;
  pen.lineWidth = 1.6;
  for (const shift of [-size, 0, size]) {
    pen.beginPath();
    pen.moveTo(shift - 1, size + 1);
    pen.lineTo(shift + size + 1, -1);
    pen.stroke();
  }
}

/**
 * @param {CanvasRenderingContext2D} pen
 * @param {number} middle
 * @param {string} colour
 * @param {string} halo
 */
function ring(pen, middle, colour, halo) {
  for (const [radius, width, look] of /** @type {[number, number, string][]} */ ([[10, 7, halo], [10, 4, colour]])) {
    pen.beginPath();
    pen.arc(middle, middle, radius, 0, 2 * Math.PI);
    pen.lineWidth = width;
    pen.strokeStyle = look;
    pen.stroke();
  }
  pen.beginPath();
  pen.arc(middle, middle, 3.5, 0, 2 * Math.PI);
  pen.fillStyle = colour;
  pen.fill();
}

/**
 * @param {CanvasRenderingContext2D} pen
 * @param {import("./style.js").Colours} colour
 */
function lost(pen, colour) {
  pen.setLineDash([4, 3]);
  shape(pen, [[18, 3], [29, 32], [18, 26], [7, 32]], colour.ground, colour.held, 2);
}

/**
 * @param {CanvasRenderingContext2D} pen
 * @param {import("./style.js").Colours} colour
 */
function cross(pen, colour) {
  for (const [width, look] of /** @type {[number, string][]} */ ([[8, colour.halo], [4.5, colour.breaks]])) {
    pen.beginPath();
    pen.lineWidth = width;
    pen.lineCap = "round";
    pen.strokeStyle = look;
    pen.moveTo(6, 6);
    pen.lineTo(22, 22);
    pen.moveTo(22, 6);
    pen.lineTo(6, 22);
    pen.stroke();
  }
}
