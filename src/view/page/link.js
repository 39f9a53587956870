// The WebSocket to the program: it reads images into arrays, and connects again after a break.

/** Reads an image: its header, and an array for each plane. */
export function readImage(buffer) {
  const view = new DataView(buffer);
  if (view.getUint32(0, false) !== 0x49534f54) throw new Error("no image of isotherm");
  const length = view.getUint32(4, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, length)));
  const count = header.width * header.height;
  const planes = {};
  let at = 8 + length;
  for (const { name, bytes, scale, offset } of header.planes) {
    const values = bytes === 1 ? new Uint8Array(buffer, at, count) : new Uint16Array(buffer, at, count);
    planes[name] = { values, scale, offset };
    at += Math.ceil((bytes * count) / 4) * 4;
  }
  return { header, planes };
}

/** Connects. `on` has `image`, `state` (whether there is a connection) and a function for each type of message. */
export function connect(on) {
  let socket = null;
  let wait = 500;
  const open = () => {
    socket = new WebSocket(`ws://${location.host}/stream`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => { wait = 500; on.state(true); };
    socket.onclose = () => {
      on.state(false);
      setTimeout(open, wait);
      wait = Math.min(2 * wait, 5000);
    };
    socket.onmessage = ({ data }) => {
      if (typeof data === "string") {
        const message = JSON.parse(data);
        on[message.type]?.(message);
        return;
      }
      send({ do: "shown" });
      on.image(readImage(data));
    };
  };
  const send = (message) => {
    if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
  };
  open();
  return send;
}
