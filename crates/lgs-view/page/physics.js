// The physics panel: α, β and γ of all objects or of one, and a factor of each term of their laws.

const SCALES = [['velocity', 'α velocity'], ['potential', 'β potential'], ['force', 'γ force']];

const none = (object) => ({
  velocity: 1, potential: 1, force: 1, terms: (object.law?.terms ?? []).map(() => 1),
});

function element(name, properties, ...children) {
  const node = Object.assign(document.createElement(name), properties);
  node.append(...children);
  return node;
}

const number = (value) => (Number.isFinite(value) ? Number(value.toPrecision(3)).toString() : '–');

export class Physics {
  constructor(change) {
    this.change = change;
    this.panel = document.getElementById('physics');
    this.objects = [];
    this.edits = [];
    this.selected = null;
  }

  begin(objects) {
    const same = JSON.stringify(objects) === JSON.stringify(this.objects);
    this.objects = objects;
    if (!same) this.edits = objects.map(none);
    this.build();
  }

  /** Edits as requests take them; none where nothing is edited. */
  request() {
    const plain = this.objects.map(none);
    if (JSON.stringify(plain) === JSON.stringify(this.edits)) return [];
    const terms = (edit) => (edit.terms.every((factor) => factor === 1) ? [] : edit.terms);
    return this.edits.map((edit) => ({ ...edit, terms: terms(edit) }));
  }

  state() {
    return this.request().length ? this.edits : null;
  }

  restore(edits) {
    const fits = (edit, i) => edit && Array.isArray(edit.terms)
      && edit.terms.length === none(this.objects[i]).terms.length
      && [edit.velocity, edit.potential, edit.force, ...edit.terms].every(Number.isFinite);
    if (Array.isArray(edits) && edits.length === this.objects.length && edits.every(fits)) {
      this.edits = edits;
      this.build();
    }
  }

  reset() {
    this.edits = this.objects.map(none);
    this.build();
    this.change(false);
  }

  select(index) {
    this.selected = index;
    this.panel.querySelectorAll('section[data-object]').forEach((section) => {
      const own = Number(section.dataset.object) === index;
      section.classList.toggle('selected', own);
      if (own) section.scrollIntoView({ block: 'nearest' });
    });
  }

  build() {
    const properties = { id: 'reset', title: 'Reset all edits (R)', onclick: () => this.reset() };
    const reset = element('button', properties, 'Reset');
    const all = element('section', {}, element('h2', {}, 'All objects', reset));
    for (const [key, label] of SCALES) {
      const values = this.edits.map((edit) => edit[key]);
      const common = values.every((value) => value === values[0]) ? values[0] : 1;
      all.append(this.row(`all-${key}`, label, common ?? 1, (value) => {
        this.edits.forEach((edit) => { edit[key] = value; });
      }));
    }
    this.panel.replaceChildren(all, ...this.objects.map((object, index) => this.section(object, index)));
    if (this.selected !== null) this.select(this.selected);
  }

  section(object, index) {
    const { law } = object;
    const dot = element('span', { className: 'dot' });
    dot.style.background = `rgb(${object.color.map((c) => 255 * c)})`;
    const claim = law?.verdict ?? 'no record';
    const verdict = element('span', { className: `verdict ${claim}` }, claim);
    const section = element('section', {}, element('h2', {}, dot, `Object ${index}`, verdict));
    section.dataset.object = index;
    const times = law?.trusted?.map(number);
    const trust = times ? `, trusted from t = ${times[0]} to ${times[1]}` : '';
    const coordinates = law?.coordinates || 'particles';
    section.append(element('small', {}, `${object.gaussians} Gaussians, ${coordinates}${trust}`));
    for (const [key, label] of SCALES) {
      section.append(this.row(`object-${index}-${key}`, label, this.edits[index][key], (value) => {
        this.edits[index][key] = value;
      }));
    }
    (law?.terms ?? []).forEach((term, k) => {
      const port = term.port === 'whole' ? '' : ` on ${term.port}`;
      const { terms } = this.edits[index];
      const set = (value) => { terms[k] = value; };
      section.append(this.row(`object-${index}-term-${k}`, term.name + port, terms[k], set));
      const values = term.parameters.map(({ name, value, deviation, unit }) => {
        const spread = deviation === null || deviation === undefined ? '' : ` ± ${number(deviation)}`;
        return `${name} ${number(value)}${spread}${unit ? ` ${unit}` : ''}`;
      });
      section.append(element('small', {}, values.join(', ')));
    });
    return section;
  }

  /** A slider from 0 to 3 with an exact entry beside it. */
  row(id, label, value, set) {
    const slider = element('input', { type: 'range', min: 0, max: 3, step: 0.01, value, id });
    const entry = element('input', { type: 'number', step: 0.1, min: 0, value });
    entry.setAttribute('aria-label', `${label}, exact`);
    const take = (next, moving) => {
      if (!Number.isFinite(next) || next < 0) return;
      slider.value = next;
      entry.value = next;
      set(next);
      this.change(moving);
    };
    slider.oninput = () => take(Number(slider.value), true);
    const rest = ({ value }) => {
      take(Number(value), false);
      if (id.startsWith('all-')) this.build();
    };
    slider.onchange = () => rest(slider);
    entry.onchange = () => rest(entry);
    return element('div', { className: 'row' }, element('label', { htmlFor: id }, label), slider, entry);
  }
}
