/**
 * What comes from the server, as `docs/console-api.md` has it, and what the page keeps itself.
 *
 * @typedef {import("./geo.js").Place} Place
 * @typedef {[number, number, number, number]} Box west, south, east, north
 * @typedef {any} Geometry GeoJSON
 *
 * @typedef {{url: string, kind: string, attribution: string}} MapSource
 * @typedef {{upload: boolean, drive: boolean, arm: boolean}} Permissions
 * @typedef {{version: string, run_id: string, source: "live" | "demo" | "log" | "files", source_name: string, can: Permissions, map: MapSource | null,
 *   reads: string[], writes: string[]}} Server
 * @typedef {{holder: string | null, since_s: number | null, is_away: boolean, pages: string[]}} Control
 * @typedef {{state: "none" | "closed" | "listening" | "ok" | "late" | "lost", heard_s: number | null, heartbeats_missed_percent: number | null,
 *   rate_hz: number | null, trouble: string}} Link
 * @typedef {{length_m: number, width_m: number, gps_forward_m: number, gps_right_m: number}} Footprint
 * @typedef {{system: number | null, autopilot: string, firmware: string, mode: number | null, mode_text: string, armed: boolean | null,
 *   position: Place | null, position_s: number | null, heading_deg: number | null, speed_mps: number | null, fix_kind: number | null, fix_text: string,
 *   fix_error_m: number | null, satellites: number | null, battery_percent: number | null, battery_v: number | null, footprint: Footprint | null,
 *   most_items: number | null}} Vehicle
 *
 * @typedef {{index: number, name: string, kind: "inclusion" | "exclusion", shape: "polygon" | "circle", radius_m: number | null, centre: Place | null}} ZoneFacts
 * @typedef {{type: "FeatureCollection", features: {type: "Feature", geometry: Geometry, properties: ZoneFacts}[]}} Zones
 * @typedef {{free: Geometry, margin: Geometry, margin_m: number, union: boolean, home_circle: {centre: Place, radius_m: number, geometry: Geometry} | null,
 *   is_bounded: boolean}} FenceMeant
 * @typedef {{name: string, position: Place, radius_m: number, ends_s: number | null}} Obstacle
 * @typedef {{id: string, held: Zones, return_point: Place | null, meant: FenceMeant | null, obstacles: Obstacle[], where: string, source: string,
 *   enabled: boolean | null, time_s: number | null, trouble: string, warnings: string[]}} Fence
 *
 * @typedef {{targets: Place[], clearance_m: number | null, widest: boolean, order: string, end: string, comes_back: boolean, speed_mps: number | null,
 *   reserve_m: number}} Asked
 * @typedef {{at: Place, seq: number, time_s: number, text: string}} RoutePoint
 * @typedef {{name: string, index: number, start: Place, end: Place, length_m: number, time_s: number, speed_mps: number | null, drawn_m: number | null,
 *   driven_m: number | null, asked_m: number | null, verdict: string, fence: string, at: Place | null, crosses: string[], text: string}} Leg
 * @typedef {{s_m: number, time_s: number, drawn_m: number | null, clearance_m: number | null, speed_mps: number}} ProfileSample
 * @typedef {{kind: string, message: string, advice: string, details: Record<string, any>, at: Place | null, blockers: {name: string, geometry: Geometry | null}[],
 *   widest: {clearance_m: number, at: Place | null, between: string[], path: Geometry | null, is_driven: boolean} | null}} NoRoute
 * @typedef {{id: string, state: string, by: string, took_s: number | null, request: Asked, start: Place | null, targets: Place[], asked_targets: Place[],
 *   length_m: number | null, straight_line_m: number | null, duration_s: number | null, promised_m: number | null, asked_m: number | null,
 *   drawn_m: number | null, driven_m: number | null, start_m: number | null, is_promised: boolean, extrapolated: string[], info: string[],
 *   warnings: string[], dangers: string[], points: RoutePoint[], legs: Leg[], corridor: Geometry | null,
 *   narrowest: {ends: Place[], width_m: number, leg: number} | null, profile: ProfileSample[], items: number, changed: string[],
 *   no_route: NoRoute | null}} Plan
 * @typedef {{id: string, items: number, points: Place[], matches_plan: boolean, time_s: number | null, current_seq: number | null}} HeldMission
 *
 * @typedef {{state: string, state_text: string, since_s: number | null, awaits_upload: boolean, awaits_start: boolean, plan_id: string, can_resume: boolean, is_left_armed: boolean, trouble: string,
 *   way_home: string, is_driving: boolean, begun_s: number | null, next_seq: number | null, progress_m: number | null, length_m: number | null,
 *   left_m: number | null, eta_s: number | null, driven_m: number | null, deviation_m: number | null, corridor_ok: boolean,
 *   least_clearance_m: number | null, least_at: Place | null, asked_m: number | null, breaches: number}} Drive
 * @typedef {{state: "none" | "sent" | "answered" | "stopped" | "no_answer", text: string, by: string, asked_s: number | null, answered_s: number | null}} Hold
 * @typedef {{what: string, state: "running" | "verified" | "failed", done: number, count: number, text: string, advice: string, backup: string,
 *   time_s: number | null}} Transfer
 * @typedef {{id: number, time_s: number, name: string, severity: string, text: string, position: Place | null, data: Record<string, any>}} Event
 * @typedef {[number, number, number, number, number | null]} TrackRow time_s, longitude, latitude, speed_mps, mode
 * @typedef {{begin_s: number, end_s: number, now_s: number, is_read: boolean, name: string}} Replay
 *
 * @typedef {{name: string, places: Place[]}} NamedLine
 * @typedef {{name: string, at: Place, icon: "blocked" | "target"}} NamedMark
 *
 * @typedef {{kind: "inclusion" | "exclusion", shape: "polygon", ring: Place[]} | {kind: "inclusion" | "exclusion", shape: "circle", centre: Place, radius_m: number}} Zone
 * @typedef {{at: Place, speed_mps: number | null}} MissionPoint
 *
 * What a person has drawn and asked for; every step of it can be undone.
 * @typedef {object} Doc
 * @property {Place | null} start where a plan begins, where no vehicle says so
 * @property {Place[]} targets
 * @property {number | null} clearance_m null: the fence's own margin
 * @property {boolean} widest
 * @property {"given" | "best"} order
 * @property {boolean} comes_back
 * @property {Zone[] | null} zones a fence drawn here; null is the one that the vehicle or the file holds
 * @property {DrawnMission | null} mission a mission dropped here, or a route with points moved by hand; null plans to the targets
 *
 * @typedef {{name: string, points: Place[], items: any[] | null}} DrawnMission items as they were read; null once a point was moved
 *
 * @typedef {object} PageState
 * @property {Server} server
 * @property {Control} control
 * @property {Link} link
 * @property {Vehicle} vehicle
 * @property {Fence} fence as it is held
 * @property {Fence | null} looked the fence drawn here, as the server understands it
 * @property {Place[]} rally
 * @property {Place | null} home
 * @property {Asked} request
 * @property {Plan | null} plan what is shown: the page's own newest, or the director's
 * @property {Plan | null} standing the director's plan
 * @property {HeldMission | null} mission
 * @property {Drive} drive
 * @property {Hold} hold
 * @property {Transfer | null} upload
 * @property {Replay | null} replay
 * @property {Event[]} events
 * @property {Doc} doc
 * @property {string} page this page's public name
 * @property {boolean} isConnected
 * @property {number} clock_s the server's clock, as far as this page knows it
 * @property {boolean} isPlanning
 * @property {import("./connection.js").Refusal | null} planTrouble
 * @property {number | null} hoverLeg
 * @property {number | null} hoverAlong_m
 * @property {number | null} widest_m the widest clearance possible for the shown targets
 * @property {NamedLine[]} lines what is drawn besides in a page that is one file: ways home, lines to rally points
 * @property {NamedMark[]} marks places that must not be missed in it
 * @property {"target" | "add" | "start" | "polygon" | "circle" | "none"} tool what a click on the map does
 * @property {Place[]} drawn the corners so far of a zone that is being drawn
 * @property {"inclusion" | "exclusion"} newKind what a zone that is drawn next will be
 * @property {number | null} zone which drawn zone is being edited
 * @property {string} holdSent what became of a HOLD before the vehicle's answer; empty where the answer tells
 * @property {{name: string, remarks: string[]} | null} opened the newest file that was opened here
 * @property {any} after what was driven against what was promised
 */
export {};
