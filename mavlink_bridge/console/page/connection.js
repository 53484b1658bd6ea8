/** The server: requests and their answers, and the live messages. Nothing else on this page talks to anyone. */

import { isServed } from "./inside.js";

/** @typedef {{kind: string, message: string, advice: string, details: Record<string, any>}} Refusal */

const SILENT_MS = 3000; // the server says something every second: three missed are a lost connection
const CONNECT_MS = 10_000; // for a connection to be there: on a slow network, or a busy computer, it takes more than what is a silence later; chosen
const AGAIN_MS = 1000; // between tries to connect anew; chosen
const ANSWER_MS = 30_000; // no answer is waited for longer, except by plans, which are cancelled by newer ones

/** A page's own secret name: control belongs to a tab. It lies in the tab's store only while the page is reloaded, so that a tab that is duplicated gets one of its own. */
export const PAGE_ID = isServed ? ownId() : "";

function ownId() {
  const id = sessionStorage.getItem("page-id") ?? crypto.getRandomValues(new Uint32Array(4)).join("-");
  sessionStorage.removeItem("page-id");
  window.addEventListener("pagehide", () => sessionStorage.setItem("page-id", id));
  window.addEventListener("pageshow", () => sessionStorage.removeItem("page-id"));
  return id;
}

/** The server that this page shows, and its clock: what is asked for is meant for that one and for now, and refused by another and later. */
export const meant = { run_id: "", ahead_s: NaN };

/** What the server would not do, with its words. */
export class RefusedError extends Error {
  /** @param {Refusal} refusal */
  constructor(refusal) {
    super(refusal.message);
    this.refusal = refusal;
  }
}

/**
 * Ask the server.
 * @param {string} path
 * @param {object} [options]
 * @param {any} [options.body] JSON, or a file's bytes
 * @param {"GET" | "POST"} [options.method]
 * @param {AbortSignal} [options.signal]
 * @returns {Promise<Response>}
 */
async function request(path, { body, method = "POST", signal } = {}) {
  const isBytes = body instanceof Blob;
  const answer = await fetch(path, {
    method, signal: signal ?? AbortSignal.timeout(ANSWER_MS), cache: "no-store", credentials: "same-origin",
    headers: { "X-Page-Id": PAGE_ID, ...whenMeant(), ...(method === "POST" ? { "Content-Type": isBytes ? "application/octet-stream" : "application/json" } : {}) },
    ...(method === "POST" ? { body: isBytes ? body : JSON.stringify(body ?? {}) } : {}),
  });
  if (!answer.ok) {
    throw new RefusedError(await refusalOf(answer));
  }
  return answer;
}

/** @returns {Record<string, string>} */
function whenMeant() {
  return meant.run_id ? { "X-Run-Id": meant.run_id, "X-Asked-S": (performance.now() / 1000 + meant.ahead_s).toFixed(3) } : {};
}

/** @param {Response} answer @returns {Promise<Refusal>} */
async function refusalOf(answer) {
  try {
    const { error } = await answer.json();
    return { advice: "", details: {}, ...error };
  } catch {
    return { kind: String(answer.status), message: `${answer.status} ${answer.statusText}`, advice: "", details: {} };
  }
}

/**
 * @param {string} path
 * @param {any} [body]
 * @param {AbortSignal} [signal]
 */
export async function post(path, body, signal) {
  return (await request(path, { body, signal })).json();
}

/** @param {string} path */
export async function get(path) {
  return (await request(path, { method: "GET" })).json();
}

/**
 * A file made by the server.
 * @param {string} path
 * @param {any} body
 */
export async function postForFile(path, body) {
  const answer = await request(path, { body });
  const name = /filename="([^"]+)"/.exec(answer.headers.get("Content-Disposition") ?? "")?.[1] ?? "pbpp";
  return { name, data: await answer.blob() };
}

/** The printed link carries its token behind the #, which is sent to nobody: it is changed for a cookie, and taken out of the address. */
export async function beginSession() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  if (token) {
    history.replaceState(null, "", location.pathname + location.search);
    await post("/api/session", { token });
  }
}

/** The live messages, connected anew whenever they stop. */
export class Live {
  /**
   * @param {(message: any) => void} onmessage
   * @param {(isConnected: boolean) => void} onconnection
   */
  constructor(onmessage, onconnection) {
    this.onmessage = onmessage;
    this.onconnection = onconnection;
    /** @type {WebSocket | null} */
    this.socket = null;
    this.seq = -1;
    /** The server's clock ahead of ours, by the message of this connection that came quickest. */
    this.ahead_s = -Infinity;
    this.silence = 0;
    this.again = 0;
    this.connect();
  }

  connect() {
    clearTimeout(this.again);
    const address = new URL("/api/live", location.href);
    address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    address.searchParams.set("page", PAGE_ID);
    const socket = new WebSocket(address);
    this.socket = socket;
    this.seq = -1;
    this.ahead_s = -Infinity;
    socket.addEventListener("message", (event) => this.hear(socket, JSON.parse(event.data)));
    socket.addEventListener("close", () => this.lose(socket));
    this.watch();
  }

  /**
   * @param {WebSocket} socket
   * @param {any} message
   */
  hear(socket, message) {
    if (socket !== this.socket) {
      return;
    }
    const ahead_s = message.time_s - performance.now() / 1000;
    this.ahead_s = Math.max(this.ahead_s, ahead_s);
    // What comes so late is no picture of now, however much of it comes: a network that holds things up is as good as none.
    if ((message.type !== "snapshot" && message.seq !== this.seq + 1) || this.ahead_s - ahead_s > SILENT_MS / 1000) {
      this.lose(socket);
      return;
    }
    this.seq = message.seq;
    this.watch();
    this.onconnection(true);
    this.onmessage(message);
  }

  watch() {
    clearTimeout(this.silence);
    const socket = this.socket;
    this.silence = setTimeout(() => socket && this.miss(socket), SILENT_MS);
  }

  /**
   * Nothing was heard: a connection that is still being made gets more time, and it is said that there is none.
   * @param {WebSocket} socket
   */
  miss(socket) {
    if (socket === this.socket && socket.readyState === WebSocket.CONNECTING) {
      this.onconnection(false);
      this.silence = setTimeout(() => this.lose(socket), CONNECT_MS - SILENT_MS);
    } else {
      this.lose(socket);
    }
  }

  /** @param {WebSocket} socket */
  lose(socket) {
    if (socket !== this.socket) {
      return;
    }
    this.socket = null;
    clearTimeout(this.silence);
    socket.close();
    this.onconnection(false);
    this.again = setTimeout(() => this.connect(), AGAIN_MS);
  }

  /** @param {any} message */
  send(message) {
    if (this.socket?.readyState === WebSocket.OPEN) {
      this.socket.send(JSON.stringify(message));
    }
  }
}
