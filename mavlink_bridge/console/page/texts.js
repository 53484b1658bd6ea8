/** Every word that the page shows, in one table. Another language: a table of the same shape, chosen at the end of this file. */

/** @param {number | null | undefined} value
 * @param {number} [digits] */
const m = (value, digits = 2) => (value === null || value === undefined ? "no fence near" : `${value.toFixed(digits)} m`);

/** @param {number | null | undefined} seconds */
const duration = (seconds) => {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) {
    return "–";
  }
  const whole = Math.round(seconds);
  const two = (/** @type {number} */ n) => String(n).padStart(2, "0");
  return whole < 3600 ? `${Math.floor(whole / 60)}:${two(whole % 60)} min` : `${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)} h`;
};

/** @param {number} time_s seconds since 1970 */
const clock = (time_s) => new Date(time_s * 1000).toLocaleTimeString("en-GB");

/** @param {number} age_s */
const age = (age_s) => (age_s < 10 ? `${Math.max(0, age_s).toFixed(1)} s` : duration(age_s));

/** @type {Record<string, string>} */
const VERDICTS = { keeps: "keeps it", near: "near, like the start", breaks: "TOO NEAR", extrapolated: "extrapolated", "": "not measured" };
/** @type {Record<string, string>} */
const VERDICT_SIGNS = { keeps: "✓", near: "≈", breaks: "✗", extrapolated: "?", "": "–" };

const en = {
  m, duration, clock, age,
  name: "PBPP Rover",
  language: "en",
  skip: "Skip to the panel",
  skipHold: "Skip to HOLD",
  tabs: { plan: "Plan", drive: "Drive", fence: "Fence", files: "Files", events: "Events" },
  foundHere: "What was found",
  tabsName: "Parts of the page",
  noScript: "This page needs JavaScript. HOLD: use your transmitter or your ground station.",
  close: "Close",
  cancel: "Cancel",
  coordinates: "Latitude, longitude",
  badPlace: "Type latitude and longitude in degrees, such as 51.5, -0.12.",

  top: {
    still: "A page in one file: nothing on it is live.",
    state: "State of the vehicle",
    source: /** @param {string} kind @param {string} name */ (kind, name) => ({ live: `Live: ${name}`, demo: "Demonstration: a simulated rover", log: `Log: ${name}`, files: `Files: ${name}` })[kind] ?? name,
    mode: "Mode", armed: "Armed", disarmed: "Disarmed", armedUnknown: "Armed?", fix: "Fix", battery: "Battery", speed: "Speed", link: "Link",
    unknown: "–",
    notKnown: "not known", heartbeat: /** @param {number} age_s */ (age_s) => `heartbeat ${age(age_s)} ago`,
    missed: /** @param {number} percent */ (percent) => `${Math.round(percent)} % missed`,
    links: /** @type {Record<string, string>} */ ({ none: "no vehicle", closed: "closed", listening: "listening", ok: "ok", late: "late", lost: "LOST" }),
    satellites: /** @param {number} n */ (n) => `${n} sat.`,
    control: { yours: "This page holds control", free: "No page holds control", other: /** @param {string} who */ (who) => `${who} holds control`, away: " (away)",
      take: "Take control", give: "Give up control", confirm: /** @param {string} who */ (who) => `Take control from ${who}? That page is told, and can then only watch. Its pending requests are cancelled.`,
      taken: /** @param {string} who */ (who) => `${who} took control: this page can only watch, and HOLD.`, lost: "This page has lost control: it was gone for more than 10 s, or pbpp was restarted. Take control again." },
    you: /** @param {string} page */ (page) => `You are ${page}`,
    onlyLook: { upload: "Look only: started without --upload", drive: "Cannot drive: started without --drive" },
  },
  alarm: {
    lost: "LINK LOST. What you see is old. Use your transmitter.",
    late: "No heartbeat.",
    since: /** @param {string} age_text */ (age_text) => `Last heartbeat ${age_text} ago.`,
    closed: /** @param {string} why */ (why) => `LINK LOST. What you see is old. Use your transmitter. pbpp opens the link again: ${why}`,
    page: "This page has lost its connection to pbpp, and tries again. HOLD from here does not reach the vehicle: use your transmitter.",
    breach: /** @param {number} n */ (n) => `FENCE BREACHED in this drive${n === 1 ? "" : `, ${n} times`}.`,
    leftArmed: "The rover is ARMED and stands in HOLD: pbpp armed it for a drive that has not begun. Disarm it, or start the drive again.",
    restarted: "pbpp was restarted: the page shows its present state.",
  },
  map: {
    nameHere: "Map. Arrow keys move it, plus and minus zoom.",
    name: "Map. Arrow keys move it, plus and minus zoom, T puts a target in its middle.",
    area: "Map",
    home: "home", target: "target", start: "start",
    targetOf: /** @param {number} n */ (n) => `target ${n}`,
    rally: /** @param {number} n */ (n) => `rally ${n}`,
    handleKeys: "Drag it, or move it with the arrow keys", handleKeysRemove: "Drag it, or move it with the arrow keys; Delete removes it",
    point: /** @param {number} n */ (n) => `Waypoint ${n}`,
    corner: /** @param {number} n */ (n) => `Corner ${n}`,
    between: /** @param {number} n */ (n) => `New corner after corner ${n}`,
    centre: "Centre of the circle", rim: "Radius of the circle",
    controls: { "NavigationControl.ZoomIn": "Zoom in", "NavigationControl.ZoomOut": "Zoom out", "NavigationControl.ResetBearing": "North up: drag to turn the map, press to turn north up",
      "ScaleControl.Meters": "m", "ScaleControl.Kilometers": "km", "AttributionControl.ToggleAttribution": "Who made the map", "Map.Title": "Map" },
    noWebGl: "This browser has no WebGL, so there is no map to click: type targets beside it. The picture shows the newest plan.",
    noWebGlHere: "This browser has no WebGL, so there is no map. The tables hold what it would show.",
    pictureName: "The server's picture of fence, plan and rover",
    legend: "What the map shows",
    legendRows: [
      ["leg-keeps", "leg that keeps the clearance"], ["leg-near", "leg near the fence, like the start"], ["leg-breaks", "leg that does not keep the clearance (also marked ✗)"],
      ["leg-extrapolated", "extrapolated: predicted, not promised"], ["corridor", "predicted corridor"], ["kept", "allowed, and keeps the clearance"],
      ["exclusion", "keep out"], ["track", "driven by the mission"], ["track-hand", "driven in another mode"], ["draft", "being drawn"],
    ],
  },
  tools: {
    name: "Tools", fit: "Show all", follow: "Follow the rover", undo: "Undo", redo: "Redo", picture: "Save a picture (PNG)", legend: "Legend",
    undone: /** @param {string | null} what */ (what) => (what ? `Undone: ${what}` : "Nothing to undo"),
    redone: /** @param {string | null} what */ (what) => (what ? `Redone: ${what}` : "Nothing to redo"),
    finish: "Close the polygon", stop: "Stop drawing",
    drawing: { polygon: "Click the corners; click the first one again, or press Enter or ✓, to close. Esc or ✗ cancels.", circle: "Click the centre, then the rim. Esc or ✗ cancels." },
  },
  steps: {
    start: "start set", target: "target set", addTarget: "target added", moveTarget: "target moved", removeTarget: "target removed", orderTargets: "targets put in order",
    clearance: "clearance changed", order: "order of targets", comesBack: "return to the start", zone: "fence zone drawn", drawnCorner: "corner drawn", moveCorner: "corner moved", removeCorner: "corner removed",
    addCorner: "corner added", zoneKind: "stay in and keep out swapped", removeZone: "zone removed", radius: "radius changed", takeFence: "fence taken for editing", heldFence: "back to the vehicle's fence",
    movePoint: "waypoint moved", dropMission: "mission opened", dropFence: "fence opened", dropTargets: "targets opened", plannedRoute: "back to planning", repair: "mission repaired", clear: "all cleared",
  },
  plan: {
    title: "Plan",
    targets: "Targets", noTargets: "None yet. Click the map, or type a place.",
    start: "Start", startHint: "No vehicle reports its position: set the start here.", clickStart: "sets the start", noStart: "Remove the start",
    needsStart: "Where does the rover start?", needsStartWhy: "No vehicle reports its position, and the file holds no home. Click the start on the map, or type the place.", askStart: "Click the start on the map",
    clickSets: "sets the target", clickAdds: "adds a target",
    clicks: "Map click:",
    targetN: /** @param {number} n */ (n) => `Target ${n}, latitude and longitude`,
    up: /** @param {number} n */ (n) => `Target ${n} earlier`, down: /** @param {number} n */ (n) => `Target ${n} later`, remove: /** @param {number} n */ (n) => `Remove target ${n}`,
    add: "Add", newTarget: "New target: latitude, longitude", clear: "Clear all",
    best: "In the best order", comesBack: "Return to the start",
    clearance: "Clearance to keep while driving", clearanceM: "metres",
    own: /** @param {number | null} value */ (value) => (value === null ? "default" : `default: ${m(value)}`),
    widest: "Widest", widestPossible: /** @param {number} value */ (value) => `widest possible: ${m(value)} for drawn lines`,
    askWidest: "find the widest possible",
    working: "Planning …", checking: "Checking …",
    cancelled: "Planning was cancelled.", again: "Plan",
    nothing: "No plan yet: click the map to set a target.",
    nothingHere: "No plan here.",
    promised: /** @param {number} value */ (value) => `${m(value)} promised`,
    predictedOnly: "Predicted, not promised", drawnOnly: "Drawn lines only, nothing promised",
    holds: "Every leg keeps its clearance", breaks: /** @param {number} n */ (n) => (n === 1 ? "1 leg does not keep the clearance" : `${n} legs do not keep the clearance`),
    facts: /** @param {number | null} length_m @param {number | null} time_s @param {number} n */ (length_m, time_s, n) => `${(length_m ?? 0).toFixed(1)} m · ${duration(time_s)} · ${n} ${n === 1 ? "waypoint" : "waypoints"}`,
    took: /** @param {number} seconds */ (seconds) => `${seconds < 1 ? `${Math.round(seconds * 1000)} ms` : `${seconds.toFixed(1)} s`}`,
    narrowest: /** @param {number} width_m */ (width_m) => `narrowest: ${m(width_m)} wide`,
    byDirector: "This is the plan that pbpp holds for the vehicle.", byPage: "A preview: nothing of it is on the vehicle.",
    byPlan: "As planned when this file was written.", byLog: "What the bridge planned, or would have planned, at this moment of the log.", byCheck: "A mission as it was checked when this file was written.",
    keeps: /** @param {Record<string, number | null>} keeps */ ({ drawn_m, driven_m }) => `Drawn lines keep ${m(drawn_m)}, the predicted track ${m(driven_m)}.`,
    startKeeps: /** @param {number} value */ (value) => `While leaving the start it keeps ${m(value)}: there is no more room there.`,
    extrapolated: "Extrapolated: outside what was measured",
    notes: { dangers: "Dangers", warnings: "Warnings", info: "Notes", extrapolated: "Extrapolated", changed: "Changed by the repair" },
    legs: "Legs", legHead: ["Leg", "Length", "Time", "Drawn", "Driven", "Verdict"],
    legsName: "Legs of the route; the leg that has focus is shown on the map",
    verdict: /** @param {string} verdict */ (verdict) => `${VERDICT_SIGNS[verdict] ?? "–"} ${VERDICTS[verdict] ?? verdict}`,
    legBreaks: /** @param {{name: string, driven_m: number | null}} leg */ (leg) => `✗ ${leg.driven_m === null ? "" : m(leg.driven_m)}`,
    moved: "A waypoint was moved by hand: this is a check of that route, not a plan.",
    opened: /** @param {string} name */ (name) => `Checked: ${name}`,
    backToPlanning: "Back to planning", repair: "Repair around the fence",
    upload: "Upload, verified", uploadHint: "Writes the mission to the vehicle, reads it back and compares.",
    points: "Waypoints", pointN: /** @param {number} n */ (n) => `Waypoint ${n}, latitude and longitude`,
    superseded: "Replaced by a newer request.",
  },
  noRoute: {
    title: "No route", here: "here", widest: /** @param {number} value */ (value) => `The widest route there is keeps ${m(value)} (dashed: its straight legs).`, take: /** @param {number} value */ (value) => `Ask for ${m(value)} instead`,
    widestDrawn: "Dashed: the straight legs of the widest route. A rover that drives it keeps less.", takeWidest: "Plan the widest route",
    between: /** @param {string[]} names */ (names) => `It is narrowest ${names.length > 1 ? "between" : "at"} ${names.join(" and ")}.`,
    blockers: "In the way (thick lines)", none: "No route at all, however narrow.",
  },
  start: {
    hold: "Start: press and hold", holding: "Keep holding …", noUpload: "pbpp was started without --upload: nothing is written to the vehicle.", noDrive: "pbpp was started without --drive: it cannot start a drive.",
    noControl: "Take control first: the button is at the top of the page.", lost: "This page has lost its connection to pbpp: nothing can be sent.", noPlan: "To start, upload the plan: only what is verified on the vehicle is driven.", byHand: "Start drives only what was planned here. Start a mission of your own with your ground station or transmitter.", other: "This plan is not on the vehicle: upload it, then start it.", arms: "Arms the vehicle and switches to AUTO.", noArm: "Switches to AUTO. The vehicle must be armed: pbpp was started without --arm.",
    name: "Start: press and hold for one second.",
  },
  hold: {
    button: "HOLD", key: "key H", name: "HOLD key H: stops the rover now.",
    missing: "HOLD is off: pbpp was started without --drive and sends nothing. Use your transmitter.",
    noVehicle: "No vehicle here: nothing to hold.",
    sending: "HOLD is being sent …", failed: /** @param {string} why */ (why) => `HOLD WAS NOT SENT: ${why} Use your transmitter.`,
    states: /** @type {Record<string, string>} */ ({ none: "", sent: "HOLD sent, waiting for the vehicle …", answered: "The vehicle is in HOLD", stopped: "The vehicle is in HOLD and stands", no_answer: "NO ANSWER TO HOLD. Use your transmitter." }),
  },
  drive: {
    title: "Drive", state: "State", progress: "Progress", left: "Left", eta: "Arrives in", deviation: "Off the line", least: "Least clearance so far", next: "Next waypoint", asked: "Promised",
    along: /** @param {number} progress_m @param {number} length_m */ (progress_m, length_m) => `${progress_m.toFixed(1)} of ${length_m.toFixed(1)} m`,
    off: /** @param {number} deviation_m @param {boolean} isInside */ (deviation_m, isInside) => `${deviation_m.toFixed(2)} m, ${isInside ? "inside the corridor" : "OUTSIDE THE CORRIDOR"}`,
    leastHere: /** @param {number} value */ (value) => `least ${m(value)}`,
    resume: "Go on to the target", resumeName: "Go on to the target: press and hold for one second.", blocked: "Blocked here", clearBlocked: "Forget blocked places", blockedHint: "Marks an obstacle in front of the rover and plans around it. This protects no person.",
    going: "Go on with the drive", breaches: /** @param {number} n */ (n) => (n === 1 ? "1 fence breach" : `${n} fence breaches`), wayHome: "Way home",
    holdState: "HOLD", none: "No drive under way.",
    trouble: "Trouble",
  },
  after: { title: "Driven and promised", promised: "Promised", least: "Least clearance driven", time: "Time", predicted: "predicted", deviation: "Farthest off the line", driven: "Driven", kept: "✓ The promise was kept", keptSoFar: "✓ The promise was kept so far", broken: "✗ The promise was broken", refresh: "Compare now",
    pieces: "Piece by piece, from start to stop", pieceHead: ["Piece", "Driven", "Promised", "Least", "Verdict"],
    piece: /** @param {boolean} isKept @param {boolean} hasArrived */ (isKept, hasArrived) => `${isKept ? "✓ kept" : "✗ BROKEN"}, ${hasArrived ? "arrived" : "stopped"}` },
  profile: { title: "Clearance and speed along the route", keys: "Place along the route: arrow keys move it", clearance: "clearance", drawn: "drawn line", speed: "speed", asked: "asked", along: "along the route",
    none: "No route to show.", summary: /** @param {number} least_m @param {number} at_m @param {number} speed_mps */ (least_m, at_m, speed_mps) => `Least clearance ${m(least_m)} at ${at_m.toFixed(0)} m along the route; highest speed ${speed_mps.toFixed(1)} m/s.`,
    here: /** @param {number} s_m @param {number | null} clearance_m @param {number} speed_mps */ (s_m, clearance_m, speed_mps) => `${s_m.toFixed(1)} m: ${m(clearance_m)} clear, ${speed_mps.toFixed(1)} m/s predicted` },
  fence: {
    title: "Fence", held: "As stored on the autopilot", none: "No fence.", zoneLabel: /** @param {{name: string}} zone */ (zone) => zone.name, zoneName: /** @param {{kind: string, name: string}} zone */ (zone) => (zone.kind === "exclusion" ? `keep out: ${zone.name}` : `stay in: ${zone.name}`),
    union: "Any one of the areas to stay in is enough (union).", intersection: "Only where all areas to stay in overlap (intersection).", homeCircle: /** @param {number} radius */ (radius) => `Home circle: ${m(radius, 0)}.`,
    margin: /** @param {number} value */ (value) => `Green keeps ${m(value)} from the fence.`, unbounded: "No area to stay in limits it.",
    enabled: "The autopilot enforces it.", disabled: "THE AUTOPILOT DOES NOT ENFORCE IT.", enabledUnknown: "Not known whether the autopilot enforces it.",
    source: /** @param {string} where */ (where) => `From: ${where}`,
    edit: "Edit this fence", drawn: "Drawn here; plans already go around it. Not on the vehicle.", back: "Back to the vehicle's fence", upload: "Upload the fence, verified",
    polygon: "Draw a polygon", circle: "Draw a circle", kind: "New zone", inclusion: "stay in", exclusion: "keep out", zones: "Zones",
    zone: /** @param {number} n @param {{kind: string, shape: string}} zone */ (n, zone) => `${n}. ${zone.kind === "exclusion" ? "Keep out" : "Stay in"}: ${zone.shape}`,
    turn: "Swap stay in and keep out", remove: "Remove", editZone: "Corners",
    corner: /** @param {number} n */ (n) => `Corner ${n}: latitude, longitude`, removeCorner: /** @param {number} n */ (n) => `Remove corner ${n}`, addCorner: "Add a corner", centre: "Centre: latitude, longitude", radius: "Radius, metres",
    type: "Type a zone", typeHint: "A corner a line: latitude, longitude. One line and a radius make a circle.", typeRadius: "Radius in metres, for a circle", typeAdd: "Add the zone",
    typeBad: "A polygon needs three corners, a circle one place and a radius.", obstacles: "Reported obstacles (this protects no person)",
  },
  files: {
    title: "Files", open: "Open a file", openName: /** @param {string} name */ (name) => `Open ${name}`, drop: "Drop a file anywhere on the page, or choose one: mission, fence or targets. It is checked, not uploaded.", dropNow: "Drop it to open it",
    formats: /** @param {string[]} all */ (all) => `Reads ${all.join(" ")}`,
    save: "Save", what: "What", format: "Format", download: "Save the file", whats: { plan: "The plan", mission: "The vehicle's mission", fence: "The fence" },
    backups: "Backups", noBackups: "No backups yet: one is made before anything on the vehicle is overwritten.", restore: "Restore", restoreAsk: /** @param {string} name */ (name) => `Write backup ${name} to the vehicle? What is there now is kept as a backup first.`, load: "Look again",
    opened: /** @param {string} name @param {string} what */ (name, what) => `Opened ${name}: ${what}.`, empty: "nothing to use", tooLarge: /** @param {string} name @param {number} bytes */ (name, bytes) => `${name} has ${(bytes / 1048576).toFixed(1)} MB; missions and fences have 4 MB at most. A log is shown by pbpp serve --log.`, remarks: "Remarks on the file",
    parts: { mission: /** @param {number} n */ (n) => `a mission of ${n} waypoints`, fence: /** @param {number} n */ (n) => `a fence of ${n} zones`, targets: /** @param {number} n */ (n) => `${n} targets` },
    saveDrawn: "Save what was drawn",
  },
  upload: { running: /** @param {{what: string, done: number, count: number}} t */ ({ what, done, count }) => `Uploading ${what}: ${done} of ${count}`, verified: /** @param {{what: string}} t */ ({ what }) => `The ${what} is on the vehicle, read back and compared.`,
    failed: /** @param {{what: string}} t */ ({ what }) => `The ${what} was not uploaded.`, backup: /** @param {string} name */ (name) => `Backup of what was there: ${name}` },
  events: { title: "Events", none: "Nothing has happened yet.", severities: /** @type {Record<string, string>} */ ({ critical: "Critical", error: "Error", warning: "Warning", notice: "Notice", info: "Info", emergency: "Emergency", alert: "Alert", debug: "Debug" }),
    signs: /** @type {Record<string, string>} */ ({ critical: "✖", emergency: "✖", alert: "✖", error: "✖", warning: "▲", notice: "●", info: "·", debug: "·" }), important: "Only what matters", show: "Show the place" },
  replay: { title: "Log", play: "Play", pause: "Pause", speed: "Speed", times: /** @param {number} n */ (n) => `${n}×`, at: "Moment of the log", decisions: "Decisions", next: "Next decision", previous: "Previous decision", reading: "The log is being read …",
    position: /** @param {number} now_s @param {number} begin_s @param {number} end_s */ (now_s, begin_s, end_s) => `${duration(now_s - begin_s)} of ${duration(end_s - begin_s)}, ${clock(now_s)}` },
  refused: /** @param {string} what @param {string} why */ (what, why) => `${what}: ${why}`,
  badToken: "The link's token was not accepted: use the newest link that pbpp printed.",
  failed: "Failed",
  noAnswer: "pbpp gave no answer.",
};

/** @type {Record<string, typeof en>} */
const TABLES = { en };

export const texts = TABLES[document.documentElement.lang] ?? en;
