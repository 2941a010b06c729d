// Mouse, touch and keys.

/** Orbit, pan, zoom and pick on the stage. `act` has functions orbit, pan, zoom and pick. */
export function pointers(stage, act) {
  const down = new Map();
  let moved = 0;
  stage.addEventListener('contextmenu', (event) => event.preventDefault());
  stage.addEventListener('pointerdown', (event) => {
    if (event.target.id === 'divider') return;
    stage.setPointerCapture(event.pointerId);
    stage.classList.add('dragging');
    stage.focus({ preventScroll: true });
    down.set(event.pointerId, [event.clientX, event.clientY]);
    moved = 0;
  });
  stage.addEventListener('pointermove', (event) => {
    const last = down.get(event.pointerId);
    if (!last) return;
    const others = [...down].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
    const [dx, dy] = [event.clientX - last[0], event.clientY - last[1]];
    down.set(event.pointerId, [event.clientX, event.clientY]);
    moved += Math.abs(dx) + Math.abs(dy);
    if (moved < 4) return;
    if (others.length === 1) {
      const spread = (place) => Math.hypot(place[0] - others[0][0], place[1] - others[0][1]);
      act.zoom(spread(last) / Math.max(1, spread([event.clientX, event.clientY])));
      act.pan(0.5 * dx, 0.5 * dy);
    } else if (event.shiftKey || event.buttons & 6) {
      act.pan(dx, dy);
    } else {
      act.orbit(dx, dy);
    }
  });
  const up = (event) => {
    if (!down.delete(event.pointerId)) return;
    stage.classList.toggle('dragging', down.size > 0);
    if (event.type === 'pointerup' && moved < 4) act.pick(event.clientX, event.clientY);
    if (!down.size) act.rest();
  };
  stage.addEventListener('pointerup', up);
  stage.addEventListener('pointercancel', up);
  stage.addEventListener('wheel', (event) => {
    event.preventDefault();
    act.zoom(Math.exp(0.0015 * event.deltaY * (event.deltaMode === 1 ? 16 : 1)));
  }, { passive: false });
}

/** The divider of the compare view, in per cent of the stage. */
export function divider(bar, stage) {
  const set = (part) => {
    const cut = Math.max(0, Math.min(100, part));
    stage.style.setProperty('--cut', `${cut}%`);
    bar.setAttribute('aria-valuenow', Math.round(cut));
  };
  set(50);
  bar.addEventListener('pointerdown', (event) => bar.setPointerCapture(event.pointerId));
  bar.addEventListener('pointermove', (event) => {
    if (!bar.hasPointerCapture(event.pointerId)) return;
    const box = stage.getBoundingClientRect();
    set((100 * (event.clientX - box.left)) / box.width);
  });
  bar.addEventListener('keydown', (event) => {
    const step = { ArrowLeft: -2, ArrowRight: 2 }[event.key];
    if (!step) return;
    event.stopPropagation();
    set(Number(bar.getAttribute('aria-valuenow')) + step);
  });
}

const FLY = { w: [0, 0, 1], s: [0, 0, -1], a: [-1, 0, 0], d: [1, 0, 0], q: [0, 1, 0], e: [0, -1, 0] };

/** Keys: actions by name, and flying for as long as its keys are down. */
export function keys(actions, fly) {
  const held = new Set();
  let last = 0;
  const tick = (now) => {
    if (!held.size) return;
    const time = Math.min(0.1, (now - last) / 1000);
    last = now;
    const step = [0, 1, 2].map((i) => [...held].reduce((sum, key) => sum + FLY[key][i], 0) * 0.8 * time);
    fly(...step);
    requestAnimationFrame(tick);
  };
  window.addEventListener('keydown', (event) => {
    const typing = /^(SELECT|TEXTAREA)$/.test(event.target.tagName)
      || (event.target.tagName === 'INPUT' && event.target.type !== 'checkbox');
    if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (key === ' ' && event.target.tagName === 'BUTTON') return;
    if (FLY[key]) {
      if (!held.size) { last = performance.now(); requestAnimationFrame(tick); }
      held.add(key);
    } else if (actions[key]) {
      actions[key](event);
    } else {
      return;
    }
    event.preventDefault();
  });
  window.addEventListener('keyup', (event) => held.delete(event.key.toLowerCase()));
  window.addEventListener('blur', () => held.clear());
}
