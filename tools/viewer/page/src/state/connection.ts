// The connection to the server. It is made again every second after it was lost.

import { parse_binary, type BinaryMessage, type Request, type TextMessage } from "./protocol";

const retry_time = 1000;  // ms

export interface ConnectionEvents {
  on_text(message: TextMessage): void;
  on_binary(message: BinaryMessage): void;
  /** Called at every change of state. */
  on_state(connected: boolean): void;
}

export class Connection {
  private socket: WebSocket | null = null;
  private last_id = 0;

  constructor(private readonly events: ConnectionEvents) {
    this.open();
  }

  /** @returns the id of the request; null if there is no connection, and the request is lost. */
  send(request: Request): number | null {
    if (this.socket?.readyState !== WebSocket.OPEN) return null;
    this.socket.send(JSON.stringify({ ...request, id: ++this.last_id }));
    return this.last_id;
  }

  private open(): void {
    const address = new URL("socket", location.href);
    address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    address.hash = "";
    address.search = "";
    const socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => this.events.on_state(true);
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => {
      if (typeof event.data === "string") this.events.on_text(JSON.parse(event.data) as TextMessage);
      else this.events.on_binary(parse_binary(event.data));
    };
    socket.onclose = () => {
      this.socket = null;
      this.events.on_state(false);
      setTimeout(() => this.open(), retry_time);
    };
    this.socket = socket;
  }
}
