// One robot can be chosen: everything of the others steps back.
const choose = {
  robot: null,
  apply(element) {
    const other = this.robot !== null && element.dataset.robot !== `${this.robot}`;
    element.classList.toggle('dim', other);
  },
  buttons(count, changed) {
    const host = byId('robots');
    html('span', {}, host, 'Robots');
    for (let k = 0; k < count; k++) {
      const button = html('button', {type: 'button', class: `c${k % 7}`, 'aria-pressed': 'false'}, host, `${k + 1}`);
      button.addEventListener('click', () => {
        this.robot = this.robot === k + 1 ? null : k + 1;
        host.querySelectorAll('button').forEach((other, i) => other.setAttribute('aria-pressed', i + 1 === this.robot));
        document.querySelectorAll('[data-robot]').forEach((element) => this.apply(element));
        changed();
      });
    }
  },
};

function listEvents(run, host, seek) {
  const list = html('div', {class: 'events'}, host);
  html('h3', {}, list, `${run.number}: ${run.name}`);
  if (!run.events.length) html('p', {}, list, 'None: the governor was well throughout and no robot touched a wall.');
  const items = html('ol', {}, list);
  for (const {time, text, serious} of run.events) {
    const item = html('li', serious ? {class: 'serious'} : {}, items);
    const button = html('button', {type: 'button'}, item, `${time.toFixed(2)} s`);
    button.addEventListener('click', () => seek(time));
    item.append(` ${text}`);
  }
}

// Runs on much the same floor show the same part of it.
function shareExtent(runs) {
  const area = ([x0, y0, x1, y1]) => (x1 - x0) * (y1 - y0);
  const all = [0, 1, 2, 3].map((i) => (i < 2 ? Math.min : Math.max)(...runs.map((run) => run.extent[i])));
  if (area(all) > 1.6 * Math.min(...runs.map((run) => area(run.extent)))) return;
  for (const run of runs) run.extent = all;
}

function commonReach(figure, charts, span) {
  const reaches = charts.map((chart) => chart.reach(span));
  let low = Math.min(...reaches.map(([least]) => least));
  let high = Math.max(...reaches.map(([, largest]) => largest));
  if (low > high) [low, high] = [0, 1]; // nothing to draw
  if (figure.log) return [Math.max(low, figure.log), Math.max(2 * high, 10 * Math.max(low, figure.log))];
  if (figure.zero) [low, high] = [Math.min(low, 0), Math.max(high, 0)];
  const spare = 0.06 * (high - low) || 0.5 * Math.abs(high) || 1;
  return [low - spare, high + spare];
}

function start() {
  const runs = JSON.parse(byId('data').textContent).map(opened);
  shareExtent(runs);
  byId('figures').classList.toggle('one', runs.length === 1);
  const scenes = runs.map((run) => {
    const host = html('figure', {class: 'seen'}, byId('scenes'));
    html('figcaption', {}, host, `${run.number}: ${run.name}, ${run.outcome}`);
    return new Scene(run, host);
  });
  const show = (time) => {
    runs.forEach((run, i) => scenes[i].show(frameAt(run, time)));
    for (const row of rows) for (const chart of row.charts) chart.show(time, frameAt(chart.run, time));
  };
  const clock = new Clock(runs, (time) => show(time));
  let span = null;
  const whole = [0, clock.end || 1];
  const act = {
    seek: (time) => clock.seek(time),
    zoom(wanted) {
      span = wanted && wanted[1] - wanted[0] > 4 * clock.step ? wanted : null;
      byId('whole').hidden = span === null;
      layout();
    },
  };
  byId('whole').addEventListener('click', () => act.zoom(null));
  const rows = FIGURES.map((figure) => {
    const host = html('div', {class: 'figure'}, byId('figures'));
    html('h3', {}, host, `${figure.title} [${figure.unit}]`);
    const grid = html('div', {class: 'grid'}, host);
    return {figure, charts: runs.map((run) => new Chart(run, figure, grid, act))};
  });
  runs.forEach((run) => listEvents(run, byId('events'), act.seek));
  choose.buttons(Math.max(...runs.map((run) => run.robots)), () => show(clock.time));

  function layout() {
    scenes.forEach((scene) => scene.layout(scene.root.parentElement.clientWidth));
    for (const {figure, charts} of rows) {
      const reach = commonReach(figure, charts, span ?? whole);
      charts.forEach((chart) => chart.layout(chart.box.clientWidth, span ?? whole, reach));
    }
    document.querySelectorAll('[data-robot]').forEach((element) => choose.apply(element));
    clock.seek(clock.time);
  }

  let width = 0;
  new ResizeObserver(() => {
    if (byId('scenes').clientWidth === width) return;
    width = byId('scenes').clientWidth;
    layout();
  }).observe(byId('scenes'));
}

start();
