// Training under way: stage, figures, curves, and a pause.

const POLL = 1000;

function duration(seconds) {
  if (seconds === null || seconds === undefined) return '–';
  const whole = Math.round(seconds);
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  return h ? `${h} h ${m} min` : m ? `${m} min ${s} s` : `${s} s`;
}

export class Training {
  /** `on` has functions changed (models of the same kind are new) and staged (another kind is on view). */
  constructor(connection, on) {
    Object.assign(this, { connection, on, subject: 0, stage: null });
    this.place = document.getElementById('training');
    [this.text, this.bar, this.pause] = ['text', 'bar', 'pause'].map((name) => (
      this.place.querySelector(`[data-part=${name}]`)));
    this.charts = [...this.place.querySelectorAll('canvas')];
    this.pause.onclick = () => {
      this.connection.send({ kind: 'pause', paused: !this.paused });
      this.ask();
    };
  }

  begin(training) {
    this.place.hidden = !training;
    clearInterval(this.timer);
    if (!training) return;
    this.timer = setInterval(() => this.ask(), POLL);
    this.ask();
  }

  ask() {
    if (!document.hidden) this.connection.send({ kind: 'training' });
  }

  show(sheet) {
    const { step } = sheet;
    this.paused = sheet.paused;
    this.pause.textContent = sheet.paused ? 'Go on' : 'Pause';
    if (step) {
      this.bar.max = step.steps;
      this.bar.value = step.step;
      const psnr = step.psnr === null ? '' : `, PSNR ${step.psnr.toFixed(2)} dB`;
      this.text.textContent = `${step.stage}: step ${step.step} of ${step.steps}, ${duration(sheet.eta_secs)} to go`
        + `\nloss ${step.loss.toExponential(2)}${psnr}, ${step.gaussians} Gaussians`
        + `\nserving takes ${(100 * sheet.share).toFixed(0)} % of the time`;
    }
    const [loss, psnr] = this.charts;
    draw(loss, sheet.curve, 'loss', ({ loss: value }) => Math.log10(value), (value) => (10 ** value).toExponential(1));
    draw(psnr, sheet.curve, 'PSNR', ({ psnr: value }) => value ?? NaN, (value) => `${value.toFixed(1)} dB`);
    if (sheet.subject === this.subject) return;
    this.subject = sheet.subject;
    if (step && step.stage !== this.stage) {
      this.stage = step.stage;
      this.on.staged();
    } else {
      this.on.changed();
    }
  }
}

/** A curve over all steps; lines mark where stages begin. */
function draw(canvas, curve, name, value, text) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.round(side * ratio));
  if (!width) return;
  Object.assign(canvas, { width, height });
  const context = canvas.getContext('2d');
  const points = curve.map(value);
  const finite = points.filter(Number.isFinite);
  context.font = `${10 * ratio}px system-ui`;
  context.fillStyle = '#97a3b3';
  if (!finite.length) { context.fillText(`${name} –`, 2, 12 * ratio); return; }
  const [low, high] = [Math.min(...finite), Math.max(...finite)];
  const x = (i) => (i / Math.max(1, points.length - 1)) * width;
  const y = (v) => height - 3 - ((v - low) / (high - low || 1)) * (height - 18 * ratio);
  curve.forEach(({ stage }, i) => {
    if (i && stage !== curve[i - 1].stage) context.fillRect(x(i), 0, 1, height);
  });
  context.strokeStyle = '#3aa0ff';
  context.lineWidth = ratio;
  context.beginPath();
  points.forEach((v, i) => {
    if (!Number.isFinite(v)) return;
    const from = Number.isFinite(points[i - 1]) && curve[i].stage === curve[i - 1]?.stage;
    if (from) context.lineTo(x(i), y(v)); else context.moveTo(x(i), y(v));
  });
  context.stroke();
  context.fillText(`${name} ${text(finite.at(-1))}`, 2, 12 * ratio);
}
