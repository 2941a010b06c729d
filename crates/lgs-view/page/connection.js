// The socket: requests out, pictures and answers in. Lost connections are taken up again.

export class Connection {
  /** `on` has functions hello, frame, answer and state. */
  constructor(on) {
    this.on = on;
    this.wait = 250;
    this.open();
  }

  open() {
    const address = new URL('/socket', location.href);
    address.protocol = address.protocol.replace('http', 'ws');
    this.socket = new WebSocket(address);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onmessage = ({ data }) => (typeof data === 'string' ? this.text(data) : this.picture(data));
    this.socket.onopen = () => { this.wait = 250; };
    this.socket.onclose = ({ reason }) => {
      this.on.state(false, reason);
      setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(2 * this.wait, 4000);
    };
  }

  text(data) {
    const message = JSON.parse(data);
    if (message.kind === 'hello') {
      this.on.state(true, '');
      this.on.hello(message);
    } else {
      this.on.answer(message);
    }
  }

  picture(data) {
    const length = new DataView(data).getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    this.on.frame(header, new Blob([new Uint8Array(data, 4 + length)], { type: header.mime }));
  }

  get ready() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  send(message) {
    if (this.ready) this.socket.send(JSON.stringify(message));
  }
}
