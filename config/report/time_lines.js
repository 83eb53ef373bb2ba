// Time lines by uPlot, one cursor for all of them; the band below each is the state.
const LINES = [
  {title: 'Probability', range: [0, 1.02],
    series: [['around the estimate', 'probability'], ['off the map', 'off_map']]},
  {title: 'Support', series: [['inliers', 'inliers'], ['matches', 'matches']]},
  {title: 'Sigma, m', series: [['sigma', 'sigma']], logarithmic: true},
  {title: 'Training images compared', series: [['comparisons', 'comparisons']]},
  {title: 'Time per image, ms', series: [['latency', 'latency']]},
  {title: 'Grey level (of 255)', series: [['mean', 'grey'], ['contrast', 'contrast']]},
];

// A drive that jumps, as localize --kidnap-at makes it, is drawn over the number of its images.
const isInOrder = drive && drive.t.every((t, i) => !i || t >= drive.t[i - 1]);
const axisTime = isInOrder ? drive.t : [...Array(count).keys()];

/** The runs of equal state: [first, last, state]. */
function stateRuns() {
  const runs = [];
  for (let i = 0; i < count; ++i) {
    const last = runs[runs.length - 1];
    if (last && last[2] === drive.state[i]) last[1] = i;
    else runs.push([i, i, drive.state[i]]);
  }
  return runs;
}

function lineOptions(line, runs) {
  const axis = {stroke: () => colour('faint'), grid: {stroke: () => colour('line'), width: 1}, ticks: {show: false}};
  const band = (plot) => {
    const bottom = plot.bbox.top + plot.bbox.height;
    for (const [first, last, state] of runs) {
      const from = plot.valToPos(axisTime[first], 'x', true);
      const to = plot.valToPos(axisTime[Math.min(last + 1, count - 1)], 'x', true);
      plot.ctx.fillStyle = colour(state);
      plot.ctx.fillRect(Math.max(from, plot.bbox.left), bottom - 5,
        Math.min(to, plot.bbox.left + plot.bbox.width) - Math.max(from, plot.bbox.left), 5);
    }
  };
  return {
    title: line.title, width: 500, height: 150,
    cursor: {y: false, sync: {key: 'drive'}, drag: {x: true, y: false}},
    scales: {x: {time: false}, y: line.logarithmic ? {distr: 3} : line.range ? {range: line.range} : {}},
    axes: [{...axis, size: 24}, {...axis, size: 50}],
    series: [{label: isInOrder ? 't, s' : 'image'}, ...line.series.map(([label], k) => (
      {label, stroke: () => colour(k ? 'second' : 'first'), dash: k ? [5, 3] : [], points: {show: false}}))],
    hooks: {draw: [band], setCursor: [(plot) => { if (known(plot.cursor.idx)) moment.point(plot.cursor.idx); }]},
  };
}

function startLines() {
  if (!drive) return;
  const runs = stateRuns();
  const plots = [];
  for (const line of LINES) {
    const series = line.series.filter(([, column]) => drive[column] && drive[column].some(known));
    if (!series.length) continue;
    const holder = byId('lines').appendChild(make('div'));
    const shown = line.logarithmic ? (value) => Math.max(value, 1e-3) : (value) => value;
    const values = series.map(([, column]) => drive[column].map(shown));
    const plot = new uPlot(lineOptions({...line, series}, runs), [axisTime, ...values], holder);
    plot.over.addEventListener('click', () => moment.show(plot.cursor.idx, true));
    plots.push([plot, holder]);
  }
  const fit = () => plots.forEach(([plot, holder]) => plot.setSize({width: holder.clientWidth, height: 150}));
  fit();
  window.addEventListener('resize', fit);
  darkness.addEventListener('change', fit);
  moment.listeners.push((i) => {
    for (const [plot] of plots) {
      plot.setCursor({left: plot.valToPos(axisTime[i], 'x'), top: 10}, false);
      plot.setLegend({idx: i}, false);
    }
  });
}
