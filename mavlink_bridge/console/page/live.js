/** The live messages become the page's state. */

/** @typedef {import("./types.js").PageState} PageState */

const MOST_EVENTS = 500;

/** What is known before the server has said anything. @returns {PageState} */
export function unknown() {
  return {
    server: { version: "", run_id: "", source: "files", source_name: "", can: { upload: false, drive: false, arm: false }, map: null, reads: [], writes: [] },
    control: { holder: null, since_s: null, is_away: false, pages: [] },
    link: { state: "none", heard_s: null, heartbeats_missed_percent: null, rate_hz: null, trouble: "" },
    vehicle: { system: null, autopilot: "", firmware: "", mode: null, mode_text: "", armed: null, position: null, position_s: null, heading_deg: null, speed_mps: null,
      fix_kind: null, fix_text: "", fix_error_m: null, satellites: null, battery_percent: null, battery_v: null, footprint: null, most_items: null },
    fence: { id: "", held: { type: "FeatureCollection", features: [] }, return_point: null, meant: null, obstacles: [], where: "none", source: "", enabled: null, time_s: null, trouble: "", warnings: [] },
    looked: null, rally: [], home: null,
    request: { targets: [], clearance_m: null, widest: false, order: "given", end: "hold", comes_back: false, speed_mps: null, reserve_m: 0 },
    plan: null, standing: null, mission: null,
    drive: { state: "listening", state_text: "", since_s: null, awaits_upload: false, awaits_start: false, plan_id: "", can_resume: false, is_left_armed: false, trouble: "", way_home: "", is_driving: false, begun_s: null, next_seq: null,
      progress_m: null, length_m: null, left_m: null, eta_s: null, driven_m: null, deviation_m: null, corridor_ok: true, least_clearance_m: null, least_at: null, asked_m: null, breaches: 0 },
    hold: { state: "none", text: "", by: "", asked_s: null, answered_s: null },
    upload: null, replay: null, events: [],
    doc: { start: null, targets: [], clearance_m: null, widest: false, order: "given", comes_back: false, zones: null, mission: null },
    page: "", isConnected: true, clock_s: 0, isPlanning: false, planTrouble: null, hoverLeg: null, hoverAlong_m: null, widest_m: null,
    lines: [], marks: [], tool: "target", newKind: "exclusion", drawn: [], zone: null, holdSent: "", opened: null, after: null,
  };
}

/**
 * Take a message in.
 * @param {import("./store.js").Store<PageState>} store
 * @param {any} message
 * @param {{add: (rows: import("./types.js").TrackRow[]) => void, clear: () => void}} track
 */
export function take(store, message, track) {
  if (message.type === "alive") {
    return;
  }
  // A change holds only what there is.
  const { state = {}, events = [], track: rows = [] } = message;
  const { plan, ...sections } = state;
  /** @type {Partial<PageState>} */
  const news = { ...sections };
  if (message.type === "snapshot") {
    news.page = message.you;
  }
  if (message.type === "snapshot" || "plan" in state) {
    news.standing = plan ?? null;
  }
  const isAnew = message.type === "snapshot" || message.events_anew;
  if (isAnew || events.length > 0) {
    news.events = [...(isAnew ? [] : store.state.events), ...events].slice(-MOST_EVENTS);
  }
  if (message.type === "snapshot" || message.track_anew) {
    track.clear();
  }
  track.add(rows);
  store.set(news);
}
