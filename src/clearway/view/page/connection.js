// Talks to the viewer: one question at a time over the WebSocket, answers in order.
import { saved } from "./saved.js";

const TOO_MANY_PAGES = 4001; // a code of the viewer's own

export async function fetched(path) {
  if (saved) return saved.files[path];
  const response = await fetch(path);
  if (!response.ok) throw new Error(`${path}: ${response.status}`);
  return response.json();
}

// `onLost(reason)` is told why the viewer closed the connection, null where it ended.
export function connect(onLost) {
  const address = new URL("live", location.href);
  address.protocol = "ws:";
  address.hash = "";
  const socket = new WebSocket(address);
  const waiting = [];
  const open = new Promise((resolve) => socket.addEventListener("open", resolve, { once: true }));
  socket.addEventListener("message", (event) => waiting.shift()(JSON.parse(event.data)));
  socket.addEventListener("close", ({ code, reason }) => onLost(code === TOO_MANY_PAGES ? reason : null));
  return {
    // Resolves to the answer; a refused question resolves too, with `kind` "refused".
    async ask(message) {
      await open;
      if (socket.readyState !== WebSocket.OPEN) return new Promise(() => {});
      return new Promise((resolve) => {
        waiting.push(resolve);
        socket.send(JSON.stringify(message));
      });
    },
  };
}
