// Time: the slider with the captured window and the trusted times, play, speed, loop and exact entry.

export class Timeline {
  constructor(change) {
    this.change = change;
    this.time = 0;
    this.playing = false;
    const get = (id) => document.getElementById(id);
    Object.assign(this, { slider: get('time'), entry: get('exact-time'), track: get('track') });
    Object.assign(this, { button: get('play'), speed: get('speed'), loop: get('loop') });
    this.slider.oninput = () => { this.set(Number(this.slider.value), true); };
    this.slider.onchange = () => this.change(false);
    this.entry.onchange = () => { this.set(Number(this.entry.value), false); };
    this.button.onclick = () => this.toggle();
    new ResizeObserver(() => this.paint()).observe(this.track.parentElement);
  }

  begin(times, window) {
    Object.assign(this, { times, window, trusted: [0, window] });
    [this.slider.min, this.slider.max] = times;
    [this.entry.min, this.entry.max] = times;
    this.show();
    this.paint();
  }

  set(time, moving) {
    if (!Number.isFinite(time) || !this.times) return;
    this.time = Math.max(this.times[0], Math.min(this.times[1], time));
    this.show();
    this.change(moving);
  }

  step(count) {
    this.set(this.time + (count * this.window) / 50, false);
  }

  show() {
    this.slider.value = this.time;
    if (document.activeElement !== this.entry) this.entry.value = this.time.toFixed(3);
  }

  toggle(playing = !this.playing) {
    this.playing = playing;
    this.button.textContent = playing ? '❚❚' : '▶';
    this.button.setAttribute('aria-label', playing ? 'Pause' : 'Play');
    if (playing) {
      if (this.time >= this.times[1] - 1e-6) this.time = this.times[0];
      this.last = performance.now();
      requestAnimationFrame((now) => this.tick(now));
    } else {
      this.change(false);
    }
  }

  tick(now) {
    if (!this.playing) return;
    let time = this.time + ((now - this.last) / 1000) * Number(this.speed.value) * this.window;
    this.last = now;
    if (time > this.times[1]) {
      if (!this.loop.checked) { this.set(this.times[1], false); this.toggle(false); return; }
      time = this.times[0] + ((time - this.times[0]) % (this.times[1] - this.times[0]));
    }
    this.set(time, true);
    requestAnimationFrame((next) => this.tick(next));
  }

  trust(trusted) {
    this.trusted = trusted;
    this.paint();
  }

  paint() {
    const { track } = this;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [track.clientWidth, track.clientHeight].map((side) => Math.round(side * ratio));
    if (!this.times || !width) return;
    Object.assign(track, { width, height });
    const context = track.getContext('2d');
    const thumb = 8 * ratio;
    const x = (t) => thumb + ((t - this.times[0]) / (this.times[1] - this.times[0])) * (width - 2 * thumb);
    const bar = (from, to, color, top, high) => {
      context.fillStyle = color;
      context.fillRect(x(from), top * ratio, x(to) - x(from), high * ratio);
    };
    bar(this.times[0], this.times[1], '#ff9d3a', 18, 3);
    bar(Math.max(this.trusted[0], this.times[0]), Math.min(this.trusted[1], this.times[1]), '#4fc97b', 18, 3);
    bar(0, this.window, '#3aa0ff', 22, 3);
    context.fillStyle = '#97a3b3';
    context.font = `${10 * ratio}px system-ui`;
    for (const t of [this.times[0], 0, this.window, this.times[1]]) {
      const text = String(Number(t.toFixed(2)));
      const wide = context.measureText(text).width;
      context.fillText(text, Math.max(0, Math.min(width - wide, x(t) - wide / 2)), height - ratio);
    }
  }
}
