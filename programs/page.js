import './page.css';
import './charts.js';

// ---- Tables: headers sort, and a button unfolds the other figures of a row. ----

function unfoldable(row) {
  const button = document.createElement('button'), more = row.nextElementSibling;
  button.className = 'unfold';
  button.type = 'button';
  button.setAttribute('aria-label', 'all figures of ' + row.cells[0].textContent);
  button.setAttribute('aria-expanded', 'false');
  button.addEventListener('click', () =>
    button.setAttribute('aria-expanded', String(more.classList.toggle('open'))));
  row.cells[0].prepend(button);
}

// Sorted rows are in one body without headings, so each of them names its group.
class SortableTable {
  constructor(table) {
    this.bodies = [...table.tBodies];
    this.headers = [...table.tHead.rows[0].cells];
    this.entries = [...table.querySelectorAll('tr.row')].map((row, place) => this.entry(row, place));
    this.sorted = document.createElement('tbody');
    this.table = table;
    this.headers.forEach((header, column) => {
      const button = document.createElement('button');
      button.type = 'button';
      button.append(...header.childNodes);
      header.append(button);
      header.addEventListener('click', () => this.turn(column));
    });
  }

  entry(row, place) {
    const next = row.nextElementSibling, heading = row.parentNode.querySelector('tr.group');
    const group = document.createElement('span');
    group.className = 'where';
    group.textContent = heading ? heading.textContent.trim() : '';
    const more = next && next.classList.contains('more') ? next : null;
    return {row, more, group, place, body: row.parentNode, name: row.cells[0].textContent};
  }

  // The first click sorts, the second one reverses, the third one restores the order of the page.
  turn(column) {
    const header = this.headers[column], was = header.getAttribute('aria-sort');
    for (const other of this.headers) other.removeAttribute('aria-sort');
    if (was === 'descending') return this.restore();
    header.setAttribute('aria-sort', was ? 'descending' : 'ascending');
    this.sort(column, was ? -1 : 1);
  }

  key(entry, column) {
    if (column === 0) return entry.name;
    const cell = entry.row.cells[column];
    if (!cell || cell.classList.contains('reason')) return null;  // one cell says why there are no figures
    const value = cell.dataset.value;
    return value === undefined ? cell.textContent : value === '' ? null : Number(value);
  }

  sort(column, sign) {
    const order = (a, b) => {
      const x = this.key(a, column), y = this.key(b, column);
      if (x === null || y === null) return (x === null) - (y === null) || a.place - b.place;
      const rank = typeof x === 'string' ? x.localeCompare(y) : x === y ? 0 : x < y ? -1 : 1;
      return sign * rank || a.place - b.place;
    };
    for (const entry of [...this.entries].sort(order)) {
      this.sorted.append(entry.row, ...(entry.more ? [entry.more] : []));
      if (entry.group.textContent) entry.row.cells[0].append(entry.group);
    }
    for (const body of this.bodies) body.hidden = true;
    this.table.append(this.sorted);
  }

  restore() {
    this.sorted.remove();
    for (const body of this.bodies) body.hidden = false;
    for (const entry of this.entries) {
      entry.group.remove();
      entry.body.append(entry.row, ...(entry.more ? [entry.more] : []));
    }
  }
}

for (const row of document.querySelectorAll('tr.row'))
  if (row.nextElementSibling && row.nextElementSibling.classList.contains('more')) unfoldable(row);
for (const table of document.querySelectorAll('table.sortable')) new SortableTable(table);

// ---- Pictures: all show the same part. A border that moves divides two of them. ----

class Zoom {
  constructor(section) {
    this.section = section;
    this.range = section.querySelector('.tools input');
    this.zoom = 1;
    this.x = this.y = 0;  // place of the upper left corner, percent of a picture's sides
    this.range.addEventListener('input', () => this.to(2 ** Number(this.range.value), 50, 50));
    section.querySelector('.tools button').addEventListener('click', () => this.to(1, 50, 50));
    for (const pane of section.querySelectorAll('.pane')) this.listen(pane);
  }

  at(pane, event) {
    const box = pane.getBoundingClientRect();
    return [100 * (event.clientX - box.left) / box.width, 100 * (event.clientY - box.top) / box.height];
  }

  listen(pane) {
    pane.addEventListener('wheel', event => {
      if (!event.ctrlKey && this.zoom === 1) return;  // the page scrolls
      event.preventDefault();
      this.to(this.zoom * 2 ** (-event.deltaY / 200), ...this.at(pane, event));
    }, {passive: false});
    pane.addEventListener('dblclick', event => this.to(2 * this.zoom, ...this.at(pane, event)));
    pane.addEventListener('dragstart', event => event.preventDefault());
    let last = null;
    pane.addEventListener('pointerdown', event => {
      if (this.zoom === 1) return;
      last = this.at(pane, event);
      pane.setPointerCapture(event.pointerId);
    });
    pane.addEventListener('pointermove', event => {
      if (!last) return;
      const [x, y] = this.at(pane, event);
      this.move(x - last[0], y - last[1]);
      last = [x, y];
    });
    for (const end of ['pointerup', 'pointercancel']) pane.addEventListener(end, () => { last = null; });
    pane.tabIndex = 0;
    pane.setAttribute('role', 'group');
    pane.setAttribute('aria-label', pane.querySelector('img').alt + ', plus and minus zoom, arrow keys move');
    pane.addEventListener('keydown', event => {
      const step = 10;
      const way = {ArrowLeft: [step, 0], ArrowRight: [-step, 0], ArrowUp: [0, step], ArrowDown: [0, -step]}[event.key];
      if (way && this.zoom > 1) this.move(...way);
      else if (event.key === '+') this.to(this.zoom * 2, 50, 50);
      else if (event.key === '-') this.to(this.zoom / 2, 50, 50);
      else return;
      event.preventDefault();
    });
  }

  // Zooms so that the point (x, y) of a pane stays where it is.
  to(zoom, x, y) {
    const most = 2 ** Number(this.range.max), next = Math.min(Math.max(zoom, 1), most);
    this.x = x - (x - this.x) * next / this.zoom;
    this.y = y - (y - this.y) * next / this.zoom;
    this.zoom = next;
    this.move(0, 0);
  }

  move(dx, dy) {
    const least = 100 - 100 * this.zoom;
    this.x = Math.min(0, Math.max(least, this.x + dx));
    this.y = Math.min(0, Math.max(least, this.y + dy));
    this.range.value = Math.log2(this.zoom);
    this.section.classList.toggle('zoomed', this.zoom > 1);
    this.section.style.setProperty('--zoom', this.zoom);
    this.section.style.setProperty('--x', this.x);
    this.section.style.setProperty('--y', this.y);
  }
}

for (const section of document.querySelectorAll('.pictures')) new Zoom(section);
for (const range of document.querySelectorAll('.shot input[type=range]'))
  range.addEventListener('input', () =>
    range.closest('figure').style.setProperty('--border', range.value + '%'));
