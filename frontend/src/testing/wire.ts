/** The browser's end of a WebSocket whose other end is the test. */

export class Wire {
  static readonly OPEN = 1;
  static all: Wire[] = [];
  readyState = 1;
  sent: string[] = [];
  onmessage: ((event: { data: string }) => void) | null = null;
  onclose: ((event: { code: number }) => void) | null = null;
  readonly url: string;
  constructor(url: string) {
    this.url = url;
    Wire.all.push(this);
  }
  send(text: string) {
    this.sent.push(text);
  }
  close(code = 1000) {
    this.readyState = 3;
    this.onclose?.({ code });
  }
  say(message: object) {
    this.onmessage?.({ data: JSON.stringify(message) });
  }
}

/** Return all sockets to a runner, the oldest first. */
export const wiresOf = (url: string): Wire[] =>
  Wire.all.filter((each) => each.url.startsWith(url.replace("http", "ws")));

/** Return the newest socket to a runner. */
export function wireOf(url: string): Wire {
  const wire = wiresOf(url).at(-1);
  if (wire === undefined) throw new Error(`no socket to ${url}`);
  return wire;
}
