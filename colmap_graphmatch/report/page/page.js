// Draws the report that is embedded in this page. Text of the report reaches the page by textContent alone.
(function () {
'use strict';

// ---------------------------------------------------------------------------------------------------------------------
// The report, and what is derived from it once.

const report = JSON.parse(document.getElementById('report-data').textContent);
const thumbnails = JSON.parse(document.getElementById('thumbnail-data').textContent);

const names = report.image_names;
const numImages = names.length;
const numEdges = report.edge_list.length;
const components = report.connected_components;
const minInliers = report.min_num_inliers;
// What makes the strategy test more pairs, if there is such an option.
function moreTests() {
  return {
    best_first: 'lower --GraphMatching.min_edge_probability',
    graphmatch: 'higher --GraphMatching.max_tests_for_sampling',
  }[report.strategy];
}

// In the order of a run; then those that this page does not know yet.
const stageNames = [...new Set(['sampling', 'propagation', 'listed', 'retrieval', 'expansion',
  'likeliest', ...Object.keys(report.stages)])];

// The edges by inliers, most first.
const edges = report.edge_list.slice().sort((a, b) => b[2] - a[2]);
const degrees = new Uint32Array(numImages);
for (const [a, b] of edges) {
  ++degrees[a];
  ++degrees[b];
}

// The neighbours of image i are neighbours[firstNeighbour[i]], ..., most inliers first.
const firstNeighbour = new Uint32Array(numImages + 1);
for (let i = 0; i < numImages; ++i) firstNeighbour[i + 1] = firstNeighbour[i] + degrees[i];
const neighbours = new Uint32Array(2 * numEdges);
const neighbourInliers = new Uint32Array(2 * numEdges);
{
  const next = firstNeighbour.slice();
  const add = (from, to, inliers) => {
    neighbours[next[from]] = to;
    neighbourInliers[next[from]++] = inliers;
  };
  for (const [a, b, inliers] of edges) {
    add(a, b, inliers);
    add(b, a, inliers);
  }
}

const componentOf = new Int32Array(numImages).fill(-1);
components.forEach((images, component) => images.forEach((image) => { componentOf[image] = component; }));
const componentEdges = components.map(() => 0);
for (const [a] of edges) ++componentEdges[componentOf[a]];

const edgeKey = (a, b) => Math.min(a, b) * numImages + Math.max(a, b);
const bridgeKeys = new Set(report.bridges.map(({images: [a, b]}) => edgeKey(a, b)));
const weakKeys = new Set();
for (const link of report.weak_links) for (const [a, b] of link.edges) weakKeys.add(edgeKey(a, b));
const isHighlighted = ([a, b]) => bridgeKeys.has(edgeKey(a, b)) || weakKeys.has(edgeKey(a, b));
const articulationPoints = new Map(report.articulation_points.map((point) => [point.image, point]));
const withoutEdge = new Map(report.images_without_edge.map((entry) => [entry.image, entry]));

// A forest of the edges with most inliers (Kruskal's), and the order in which it joins the images: what matches best
// lies side by side.
const {forest, seriation} = (function () {
  const parent = Uint32Array.from({length: numImages}, (_, i) => i);
  const last = parent.slice();
  const next = new Int32Array(numImages).fill(-1);
  const forest = new Set();
  const size = new Uint32Array(numImages).fill(1);
  const root = (i) => {
    while (parent[i] !== i) i = parent[i] = parent[parent[i]];
    return i;
  };
  // A tree's list of images begins at its root; the larger tree's comes first.
  for (const edge of edges) {
    let [first, second] = [root(edge[0]), root(edge[1])];
    if (first === second) continue;
    if (size[first] < size[second]) [first, second] = [second, first];
    forest.add(edge);
    parent[second] = first;
    size[first] += size[second];
    next[last[first]] = second;
    last[first] = last[second];
  }
  const seriation = [];
  for (const images of components) for (let i = root(images[0]); i >= 0; i = next[i]) seriation.push(i);
  for (let i = 0; i < numImages; ++i) if (componentOf[i] < 0) seriation.push(i);
  return {forest, seriation};
})();

// ---------------------------------------------------------------------------------------------------------------------
// Text and elements.

const byId = (id) => document.getElementById(id);
const count = (n) => n.toLocaleString('en-US');
const plural = (n, one, many) => `${count(n)} ${n === 1 ? one : many || one + 's'}`;
const images = (n) => plural(n, 'image');
const percent = (share) => {
  if (!isFinite(share)) return '–';
  const value = 100 * share;
  return `${value.toFixed(value >= 10 || value === 0 ? 1 : 2)} %`;
};
const duration = (seconds) => {
  if (seconds < 9.95) return `${seconds.toFixed(1)} s`;
  const whole = Math.round(seconds);
  if (whole < 60) return `${whole} s`;
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${whole % 60} s`;
  return `${count(Math.floor(whole / 3600))} h ${Math.floor(whole % 3600 / 60)} min`;
};
const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
// A stage without a colour of its own is grey.
const tintOf = (name) => `var(--${name}, var(--faint))`;

// element('p.note', {title: 't'}, 'text', otherElement, ...)
function element(kind, attributes, ...children) {
  const [tag, ...classes] = kind.split('.');
  const made = document.createElement(tag);
  if (classes.length) made.className = classes.join(' ');
  for (const [name, value] of Object.entries(attributes || {})) {
    if (name === 'onclick') made.addEventListener('click', value);
    else made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null));
  return made;
}

function thumbnail(image, kind = 'img.thumbnail') {
  if (!(image in thumbnails)) return null;
  return element(kind, {alt: '', loading: 'lazy', src: `data:image/jpeg;base64,${thumbnails[image]}`});
}

// Text with the names of options set as code.
const prose = (text) => text.split(/(--[A-Za-z]+\.[a-z_]+)/).map((part, i) =>
  (i % 2 ? element('code', {}, part) : part));

const imageButton = (image) =>
  element('button.name', {type: 'button', onclick: () => openPanel(image)}, names[image]);
const imageWithThumbnail = (image) => element('div.pair', {}, thumbnail(image), imageButton(image));
const swatch = (name, kind = 'span.swatch') => element(kind, {style: `background: ${tintOf(name)}`});
const legendItem = (mark, text) => element('span', {}, mark, text);
const outline = (name, kind) => element(kind, {style: `border-color: var(--${name})`});

// columns: [title, is a number]; a row: one cell (text or element) a column.
function fillTable(table, columns, rows) {
  const kind = ([, isNumber], tag) => (isNumber ? `${tag}.number` : tag);
  table.replaceChildren(
    element('thead', {}, element('tr', {}, ...columns.map((column) =>
      element(kind(column, 'th'), {scope: 'col'}, column[0])))),
    element('tbody', {}, ...rows.map((row) => tableRow(columns, row))));
  return table;
}
const tableRow = (columns, row) =>
  element('tr', {}, ...row.map((cell, i) => element(columns[i][1] ? 'td.number' : 'td', {}, cell)));

// Puts the first of many entries into the page, and the others when they are asked for.
function showInPortions(holder, container, entries, make, portion = 100) {
  let shown = 0;
  const more = element('button.more', {type: 'button', onclick: () => show(portion * 5)}, '');
  const show = (number) => {
    container.append(...entries.slice(shown, shown + number).map(make));
    shown = Math.min(entries.length, shown + number);
    more.textContent = `Show more (${count(entries.length - shown)} of ${count(entries.length)} are not shown)`;
    more.hidden = shown === entries.length;
  };
  show(portion);
  holder.append(more);
}

function listTable(holder, columns, entries, makeRow) {
  const table = fillTable(element('table'), columns, []);
  holder.append(element('div.scroll.tall', {}, table));
  showInPortions(holder, table.tBodies[0], entries, (entry, i) => tableRow(columns, makeRow(entry, i)));
}

// ---------------------------------------------------------------------------------------------------------------------
// What was found.

const stages = stageNames.filter((name) => {
  const stage = report.stages[name];
  return stage && (stage.tested > 0 || stage.known > 0 || stage.failed > 0);
});
const sumOfStages = (member) => stages.reduce((sum, name) => sum + report.stages[name][member], 0);
const testedNow = sumOfStages('tested');
const edgesNow = sumOfStages('edges');
const numWithFeatures = report.images.total - report.images.without_features;
const numPossible = numWithFeatures * (numWithFeatures - 1) / 2;
const preparation = ['mixture', 'vectors', 'ranking'];

function showHeadline() {
  const {graph} = report;
  const alone = report.images.isolated;
  byId('headline').textContent = graph.edges === 0 ?
    `No edges among ${images(report.images.total)}` :
    `${plural(graph.edges, 'edge')} among ${images(report.images.total)}: ` + (graph.components === 1 ?
      (alone === 0 ? 'all in one component' : `one component of ${images(graph.largest_component)}`) :
      `${count(graph.components)} components, the largest of ${images(graph.largest_component)}`);

  const outcome = byId('outcome');
  const reasons = {
    signal: 'The run was stopped by a signal (Ctrl-C, say)',
    max_pairs: 'The run was stopped by its budget of pairs (--GraphMatching.max_pairs)',
    max_minutes: 'The run was stopped by its budget of time (--GraphMatching.max_minutes)'};
  if (report.finished) {
    outcome.textContent = 'The run finished: nothing was left to test.';
  } else {
    outcome.append(
      element('span.warning', {}, ...prose(reasons[report.stopped_by] || 'The run did not finish')),
      ' before everything was tested. The same command goes on where it stopped.');
  }
  if (report.replay) {
    outcome.append(' It is a replay: a finished matching graph answered instead of COLMAP, and times are modelled.');
  }

  const tile = (id, title, value, detail) => {
    const definition = element('dd', {id: `key-${id}`}, element('span', {}, value));
    if (detail) definition.append(element('small', {}, detail));
    byId('key-figures').append(element('div', {}, element('dt', {}, title), definition));
  };
  const earlier = graph.tested - testedNow;
  tile('images', 'Images', count(report.images.total),
    report.images.without_features ? `${count(report.images.without_features)} without features` : '');
  tile('edges', 'Edges', count(graph.edges),
    numImages ? `${(2 * graph.edges / numImages).toFixed(1)} an image` : '');
  tile('components', 'Components', count(graph.components), 'of two images or more');
  const ofAll = (n) => (report.images.total ? `${percent(n / report.images.total)} of all images` : '');
  tile('largest', 'Largest component', count(graph.largest_component), ofAll(graph.largest_component));
  tile('isolated', 'Without an edge', count(alone), ofAll(alone));
  tile('tested', 'Pairs tested', count(graph.tested), `of ${count(numPossible)} possible` +
    (numPossible ? ` (${percent(graph.tested / numPossible)})` : '') +
    (earlier > 0 ? `; ${count(testedNow)} by this run` : ''));
  tile('efficiency', 'Efficiency', testedNow ? percent(edgesNow / testedNow) : '–',
    `${count(edgesNow)} edges in ${count(testedNow)} tests`);
  tile('time', 'Time', duration(report.seconds.modelled === undefined ? report.seconds.total :
    report.seconds.total + report.seconds.modelled), report.replay ? 'modelled' : plural(report.threads, 'thread'));
  byId('min-inliers').textContent = minInliers;
  byId('program').textContent = report.program;
}

// ---------------------------------------------------------------------------------------------------------------------
// Discovery.

function svgFor(holder, width, height, label) {
  const svg = d3.create('svg').attr('viewBox', `0 0 ${width} ${height}`).attr('height', height)
    .attr('role', 'img').attr('aria-label', label);
  holder.replaceChildren(svg.node());
  return svg;
}

function drawAxes(svg, x, y, {width, height, left, bottom, top, right, xLabel, yLabel}) {
  svg.append('g').attr('class', 'grid').attr('transform', `translate(${left},0)`)
    .call(d3.axisLeft(y).ticks(5).tickSize(-(width - left - right)).tickFormat('')).select('.domain').remove();
  svg.append('g').attr('class', 'axis').attr('transform', `translate(0,${height - bottom})`)
    .call(d3.axisBottom(x).ticks(Math.max(2, Math.min(8, width / 90))).tickSizeOuter(0));
  svg.append('g').attr('class', 'axis').attr('transform', `translate(${left},0)`)
    .call(d3.axisLeft(y).ticks(5).tickSizeOuter(0));
  svg.append('text').attr('x', width - right).attr('y', height - 6).attr('text-anchor', 'end').text(xLabel);
  svg.append('text').attr('x', 0).attr('y', top - 12).text(yLabel);
}

const timeUnit = (seconds) => (seconds > 7200 ? ['hours', 3600] : seconds > 180 ? ['minutes', 60] : ['seconds', 1]);

let overTime = false;
function drawDiscovery() {
  const points = report.discovery;
  const holder = byId('discovery-chart');
  if (points.length === 0) {
    holder.replaceChildren(element('p.note', {}, 'This run tested no pair.'));
    return;
  }
  const box = {width: Math.max(280, holder.clientWidth), height: 300, left: 52, right: 14, top: 30, bottom: 44};
  const [unit, unitSeconds] = timeUnit(points[points.length - 1].seconds);
  const at = (point) => (overTime ? point.seconds / unitSeconds : point.tests);
  const x = d3.scaleLinear([0, Math.max(at(points[points.length - 1]), 1e-9)], [box.left, box.width - box.right]);
  const y = d3.scaleLinear([0, Math.max(1, points[points.length - 1].edges)],
    [box.height - box.bottom, box.top]).nice(5);
  const svg = svgFor(holder, box.width, box.height, 'Edges found over ' + (overTime ? 'time' : 'pairs tested'));
  drawAxes(svg, x, y, {...box, xLabel: overTime ? `time since the start of the run (${unit})` : 'pairs tested',
    yLabel: 'edges found'});

  const line = d3.line().x((point) => x(at(point))).y((point) => y(point.edges));
  const draw = (run, name) => svg.append('path').attr('class', 'curve').attr('d', line(run))
    .style('stroke', tintOf(name));
  const start = {tests: 0, edges: 0,
    seconds: Math.min(points[0].seconds, d3.sum(preparation, (name) => report.seconds[name]))};
  if (overTime && start.seconds > 0) draw([{tests: 0, edges: 0, seconds: 0}, start], 'preparation');
  let run = [start];
  points.forEach((point, i) => {
    run.push(point);
    const next = points[i + 1];
    if (!next || next.stage !== point.stage) {
      draw(run, point.stage);
      run = [point];
    }
  });

  const cursor = svg.append('line').attr('class', 'cursor').attr('y1', box.top).attr('y2', box.height - box.bottom)
    .style('visibility', 'hidden');
  const bisect = d3.bisector(at).left;
  svg.on('mousemove touchmove', function () {
    const i = Math.min(points.length - 1, bisect(points, x.invert(d3.mouse(this)[0])));
    const point = points[i];
    cursor.attr('x1', x(at(point))).attr('x2', x(at(point))).style('visibility', 'visible');
    byId('discovery-readout').textContent = `After ${plural(point.tests, 'pair')} and ${duration(point.seconds)}: ` +
      `${plural(point.edges, 'edge')}, efficiency so far ${percent(point.edges / point.tests)} ` +
      `(${point.stage}, iteration ${point.iteration + 1})`;
  }).on('mouseleave', () => {
    cursor.style('visibility', 'hidden');
    byId('discovery-readout').textContent = '';
  });
}

function showDiscovery() {
  const points = report.discovery;
  const drawn = stageNames.filter((name) => points.some((point) => point.stage === name));
  byId('discovery-legend').append(...drawn.map((name) =>
    legendItem(swatch(name, 'span.swatch.line'), capital(name))));
  const preparationItem = legendItem(swatch('preparation', 'span.swatch.line'), 'Pre-processing');
  preparationItem.hidden = true;
  byId('discovery-legend').append(preparationItem);
  for (const [id, wanted] of [['over-tests', false], ['over-time', true]]) {
    byId(id).addEventListener('click', () => {
      overTime = wanted;
      byId('over-tests').setAttribute('aria-pressed', String(!overTime));
      byId('over-time').setAttribute('aria-pressed', String(overTime));
      preparationItem.hidden = !overTime;
      drawDiscovery();
    });
  }
  drawDiscovery();

  if (points.length > 1) {
    const end = points[points.length - 1];
    const before = points[Math.max(0, d3.bisector((point) => point.tests).right(points, 0.9 * end.tests) - 1)];
    const share = (end.edges - before.edges) / (end.tests - before.tests);
    let advice = `In the last tenth of its tests this run found ${plural(end.edges - before.edges, 'edge')}, ` +
      `${percent(share)} of the pairs.`;
    if (!report.finished) advice += ' It was not finished: the same command goes on.';
    else if (share > 0.05 && moreTests()) {
      advice += ` That is still a good deal: with a ${moreTests()} it would go on to find more.`;
    }
    byId('discovery-advice').append(...prose(advice));
  }

  // Most runs have no pairs that were tested before, and none that COLMAP fails on.
  const knownColumns = sumOfStages('known') > 0 ? [['Known before', true], ['of these edges', true]] : [];
  const failedColumn = sumOfStages('failed') > 0 ? [['Failed', true]] : [];
  // (A replay takes no time worth telling.)
  const timeColumn = report.replay ? [] : [['Time', true]];
  const columns = [['Stage'], ['Tested', true], ['Edges', true], ['Efficiency', true], ...timeColumn, ...knownColumns,
    ...failedColumn];
  const cells = (stage) => [count(stage.tested), count(stage.edges),
    stage.tested ? percent(stage.edges / stage.tested) : '–',
    ...(timeColumn.length ? [duration(stage.seconds)] : []),
    ...(knownColumns.length ? [count(stage.known), count(stage.known_edges)] : []),
    ...(failedColumn.length ? [count(stage.failed)] : [])];
  const label = (name) => element('span', {}, swatch(name), capital(name));
  const table = fillTable(byId('stages'), columns,
    stages.map((name) => [label(name), ...cells(report.stages[name])]));
  const total = {};
  for (const member of ['tested', 'edges', 'seconds', 'known', 'known_edges', 'failed']) {
    total[member] = sumOfStages(member);
  }
  const row = tableRow(columns, ['All', ...cells(total)]);
  row.className = 'total';
  table.tBodies[0].append(row);
}

// ---------------------------------------------------------------------------------------------------------------------
// The matching graph: all components.

const stage = byId('stage');
const maxBubbles = 300;
const stageHeight = () => Math.round(Math.max(320, Math.min(620, window.innerHeight * 0.7, stage.clientWidth)));

const bestConnected = (component) => components[component].reduce((best, image) =>
  (degrees[image] > degrees[best] ? image : best));
// The best connected image of every component stands for it; one with a thumbnail, if there is any.
const representatives = components.map((component, i) => {
  const shown = component.filter((image) => image in thumbnails);
  return shown.length ? shown.reduce((best, image) => (degrees[image] > degrees[best] ? image : best)) :
    bestConnected(i);
});

function drawOverview() {
  const width = Math.max(280, stage.clientWidth);
  const height = stageHeight();
  const alone = withoutEdge.size;
  const bubbles = components.slice(0, maxBubbles).map((component, i) => ({component: i, size: component.length}));
  if (alone > 0) bubbles.push({component: -1, size: alone});
  const svg = d3.create('svg').attr('viewBox', `0 0 ${width} ${height}`).attr('height', height)
    .attr('role', 'group').attr('aria-label', 'Components, drawn as circles');
  byId('overview').replaceChildren(svg.node());
  if (bubbles.length === 0) return;

  bubbles.sort((a, b) => b.size - a.size);
  const gap = 0.06 * Math.sqrt(bubbles[0].size) + 0.25;
  for (const bubble of bubbles) bubble.r = Math.sqrt(bubble.size) + gap;
  d3.packSiblings(bubbles);
  const left = d3.min(bubbles, (b) => b.x - b.r), right = d3.max(bubbles, (b) => b.x + b.r);
  const top = d3.min(bubbles, (b) => b.y - b.r), bottom = d3.max(bubbles, (b) => b.y + b.r);
  const scale = Math.min((width - 24) / (right - left), (height - 24) / (bottom - top),
    0.3 * height / Math.sqrt(bubbles[0].size));
  const place = (bubble) => `translate(${width / 2 + scale * (bubble.x - (left + right) / 2)},` +
    `${height / 2 + scale * (bubble.y - (top + bottom) / 2)})`;

  const defs = svg.append('defs');
  for (const bubble of bubbles) {
    const r = Math.max(1.5, scale * (bubble.r - gap));
    const open = bubble.component < 0 ?
      () => byId('without-edge').scrollIntoView() : () => openComponent(bubble.component);
    const title = bubble.component < 0 ? `${images(bubble.size)} without an edge` :
      `Component ${count(bubble.component + 1)}: ${images(bubble.size)}, ` +
      `${plural(componentEdges[bubble.component], 'edge')}`;
    const group = svg.append('g').attr('class', bubble.component < 0 ? 'bubble alone' : 'bubble')
      .attr('transform', place(bubble)).attr('tabindex', 0).attr('role', 'button').attr('aria-label', title)
      .on('click', open)
      .on('keydown', () => {
        if (d3.event.key !== 'Enter' && d3.event.key !== ' ') return;
        d3.event.preventDefault();
        open();
      });
    group.append('title').text(title);
    group.append('circle').attr('class', 'disc').attr('r', r);
    const image = bubble.component < 0 ? -1 : representatives[bubble.component];
    if (image in thumbnails && r >= 8) {
      const clip = `clip-${bubble.component}`;
      defs.append('clipPath').attr('id', clip).append('circle').attr('r', r - 1.5);
      group.append('image').attr('href', `data:image/jpeg;base64,${thumbnails[image]}`)
        .attr('x', -r).attr('y', -r).attr('width', 2 * r).attr('height', 2 * r)
        .attr('preserveAspectRatio', 'xMidYMid slice').attr('clip-path', `url(#${clip})`);
    }
    if (r >= 10) group.append('text').attr('y', r >= 30 ? -6 : 0).text(count(bubble.size));
    if (r >= 30) {
      group.append('text').attr('class', 'unit').attr('y', 9)
        .text(bubble.component >= 0 ? 'images' : r >= 44 ? 'without an edge' : 'alone');
    }
  }
}

function showOverview() {
  byId('overview').hidden = false;
  for (const id of ['inside', 'back', 'zoom', 'graph-legend', 'tooltip']) byId(id).hidden = true;
  stage.dataset.view = 'components';
  drawOverview();
  const hidden = components.slice(maxBubbles);
  byId('graph-title').textContent = components.length === 0 ? 'There is no component.' :
    `${plural(components.length, 'component')}`;
  byId('graph-explanation').textContent = 'Every circle is a component, its area the number of images; a click opens ' +
    'it. The dashed circle counts the images without an edge.';
  byId('graph-status').textContent = hidden.length === 0 ? '' :
    `Not drawn: ${count(hidden.length)} smaller components of ${images(hidden[0].length)} and less ` +
    `(${images(d3.sum(hidden, (component) => component.length))} in all), which the table below lists.`;
}

// ---------------------------------------------------------------------------------------------------------------------
// The matching graph: inside a component.

const canvas = byId('inside');
const reducedMotion = window.matchMedia('(prefers-reduced-motion: reduce)');
const linkLength = 30;
const manyEdges = 15000;
let inside = null;

// What the layout is computed from: the forest, and the strongest edges of every image. All edges of a large component
// would pull everything into one ball, and take minutes.
function layoutEdges(componentsEdges, edgesAnImage) {
  const taken = new Uint32Array(numImages);
  return componentsEdges.filter((edge) => {
    const [a, b] = edge;
    if (!forest.has(edge) && taken[a] >= edgesAnImage && taken[b] >= edgesAnImage) return false;
    ++taken[a];
    ++taken[b];
    return true;
  });
}

// A start that the forces have to change only in detail: images so far from each other as they are in steps along the
// links, as well as two dimensions allow (Brandes and Pich, Eigensolver methods for progressive multidimensional
// scaling, 2006: distances to a few pivots, and the two main directions of them).
function placeByDistances(nodes, links) {
  const n = nodes.length;
  const around = nodes.map(() => []);
  for (const {source, target} of links) {
    around[source].push(target);
    around[target].push(source);
  }
  const columns = [];
  const nearest = new Float64Array(n).fill(Infinity);
  let pivot = 0;
  while (columns.length < Math.min(n, 40)) {
    const steps = new Float64Array(n).fill(-1);
    const queue = [pivot];
    steps[pivot] = 0;
    for (let k = 0; k < queue.length; ++k) {
      for (const i of around[queue[k]]) {
        if (steps[i] >= 0) continue;
        steps[i] = steps[queue[k]] + 1;
        queue.push(i);
      }
    }
    columns.push(steps);
    // The next pivot is farthest from all of them.
    pivot = 0;
    for (let i = 0; i < n; ++i) {
      nearest[i] = Math.min(nearest[i], steps[i]);
      if (nearest[i] > nearest[pivot]) pivot = i;
    }
  }
  // Squares, centred in both directions.
  for (const column of columns) for (let i = 0; i < n; ++i) column[i] *= column[i];
  const rowMeans = Float64Array.from({length: n}, (_, i) => d3.mean(columns, (column) => column[i]));
  const mean = d3.mean(rowMeans);
  for (const column of columns) {
    const columnMean = d3.mean(column);
    for (let i = 0; i < n; ++i) column[i] = (rowMeans[i] + columnMean - mean - column[i]) / 2;
  }
  const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);
  const products = columns.map((a) => columns.map((b) => dot(a, b)));
  const directions = [];
  for (let d = 0; d < 2; ++d) {
    let direction = columns.map((_, i) => 1 + (i * (d + 1)) % 7);
    for (let round = 0; round < 100; ++round) {
      for (const earlier of directions) {
        const share = dot(direction, earlier);
        direction = direction.map((value, i) => value - share * earlier[i]);
      }
      const length = Math.sqrt(dot(direction, direction)) || 1;
      const unit = direction.map((value) => value / length);
      direction = round < 99 ? products.map((row) => dot(row, unit)) : unit;
    }
    directions.push(direction);
  }
  nodes.forEach((node, i) => {
    // (A spiral beneath, so that no two images lie on one spot.)
    node.x = 0.01 * Math.sqrt(i) * Math.cos(2.4 * i);
    node.y = 0.01 * Math.sqrt(i) * Math.sin(2.4 * i);
    columns.forEach((column, k) => {
      node.x += column[i] * directions[0][k];
      node.y += column[i] * directions[1][k];
    });
  });
  const length = d3.mean(links, ({source: a, target: b}) =>
    Math.hypot(nodes[a].x - nodes[b].x, nodes[a].y - nodes[b].y));
  for (const node of nodes) {
    node.x *= linkLength / length;
    node.y *= linkLength / length;
  }
}

function openComponent(component, selected = -1) {
  closeComponent();
  const members = components[component];
  const nodes = members.map((image) => ({image}));
  const local = new Map(members.map((image, i) => [image, i]));
  const large = members.length > 500;
  const all = edges.filter(([a]) => componentOf[a] === component);
  const highlighted = all.filter(isHighlighted);
  const backbone = layoutEdges(all, members.length <= 150 ? Infinity : large ? 3 : 6);
  const links = backbone.map(([a, b]) => ({source: local.get(a), target: local.get(b)}));
  // Four strengths of lines, the strongest first, each with as many edges: their ends one after the other.
  const drawn = (list) => [0, 1, 2, 3].map((quarter) => {
    const ends = [];
    for (const edge of list.slice(quarter * list.length / 4, (quarter + 1) * list.length / 4)) {
      if (!isHighlighted(edge)) ends.push(nodes[local.get(edge[0])], nodes[local.get(edge[1])]);
    }
    return ends;
  });
  placeByDistances(nodes, links);
  showGraphLegend(members, highlighted.some(([a, b]) => bridgeKeys.has(edgeKey(a, b))),
    highlighted.some(([a, b]) => weakKeys.has(edgeKey(a, b))));
  inside = {
    component, nodes, local, selected, hovered: -1, timer: 0, settled: false, moving: false, transform: d3.zoomIdentity,
    bins: drawn(all), backboneBins: all.length > manyEdges ? drawn(backbone) : null,
    highlighted, pictures: new Map()};

  stage.dataset.view = 'component';
  byId('overview').hidden = true;
  for (const id of ['inside', 'back', 'zoom', 'graph-legend']) byId(id).hidden = false;
  byId('graph-title').textContent = `Component ${count(component + 1)}: ${images(members.length)}, ` +
    plural(all.length, 'edge');
  canvas.setAttribute('aria-label', byId('graph-title').textContent);
  byId('graph-explanation').textContent = 'Dots are images, lines edges: the more inliers, the darker. What matches ' +
    'well lies close together. A click on an image shows its neighbours; drag to move, turn the wheel to zoom, ' +
    'Escape goes back.';
  sizeCanvas();
  canvas.focus({preventScroll: true});

  // In these steps alpha cools from 0.5 to 0.001.
  const steps = members.length > 3000 ? 80 : large ? 150 : 300;
  const simulation = d3.forceSimulation(nodes).stop().alpha(0.5).alphaDecay(1 - Math.pow(0.002, 1 / steps))
    .force('link', d3.forceLink(links).distance(linkLength))
    .force('charge', d3.forceManyBody().strength(large ? -25 : -60).theta(large ? 1.2 : 0.9).distanceMax(1500))
    .force('x', d3.forceX().strength(large ? 0.01 : 0.04))
    .force('y', d3.forceY().strength(large ? 0.01 : 0.04));
  const state = inside;
  let step = 0;
  const settleSome = () => {
    const end = performance.now() + 40;
    while (step < steps && performance.now() < end) {
      simulation.tick();
      ++step;
    }
    state.settled = step === steps;
    if (!reducedMotion.matches || state.settled) fitView();
    if (!state.settled) {
      byId('graph-status').textContent = `Arranging the images: ${Math.round(100 * step / steps)} %`;
      state.timer = setTimeout(settleSome, 0);
      return;
    }
    performance.mark('layout settled');
    byId('graph-status').textContent = '';
    state.tree = d3.quadtree(nodes, (node) => node.x, (node) => node.y);
    if (state.selected >= 0) select(state.selected);
  };
  fitView();
  state.timer = setTimeout(settleSome, 0);
}

function showGraphLegend(members, bridges, suspicious) {
  const dashes = 'background: repeating-linear-gradient(90deg, var(--warning) 0 .25rem, transparent .25rem .4rem)';
  const faint = 'background: var(--edge); opacity: .25';
  byId('graph-legend').replaceChildren(
    legendItem(element('span.swatch.line', {style: faint}), 'few inliers'),
    legendItem(swatch('edge', 'span.swatch.line'), 'many inliers'),
    ...(bridges ? [legendItem(swatch('warning', 'span.swatch.line'), 'bridge')] : []),
    ...(suspicious ? [legendItem(element('span.swatch.line', {style: dashes}), 'suspicious edge')] : []),
    ...(members.some((image) => articulationPoints.has(image)) ?
      [legendItem(outline('warning', 'span.swatch.ring'), 'articulation point')] : []));
}

function closeComponent() {
  if (inside === null) return;
  clearTimeout(inside.timer);
  clearTimeout(inside.redraw);
  inside = null;
}

function goBack() {
  const component = inside.component;
  closeComponent();
  showOverview();
  const bubbles = [...byId('overview').querySelectorAll('.bubble')];
  const bubble = bubbles.find((b) => b.getAttribute('aria-label').startsWith(`Component ${count(component + 1)}:`));
  if (bubble) bubble.focus({preventScroll: true});
}

function sizeCanvas() {
  const width = stage.clientWidth, height = stageHeight();
  const ratio = window.devicePixelRatio || 1;
  canvas.style.height = `${height}px`;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
}

const zoom = d3.zoom().scaleExtent([0.01, 20])
  .filter(() => !d3.event.button && (d3.event.type !== 'wheel' || document.activeElement === canvas ||
    d3.event.ctrlKey || d3.event.metaKey))
  .on('zoom', () => {
    if (inside === null) return;
    inside.transform = d3.event.transform;
    inside.moving = true;
    drawSoon();
  });
d3.select(canvas).call(zoom).on('dblclick.zoom', null);

function fitView() {
  const {nodes} = inside;
  const [left, right] = d3.extent(nodes, (node) => node.x);
  const [top, bottom] = d3.extent(nodes, (node) => node.y);
  const width = canvas.clientWidth, height = canvas.clientHeight;
  const k = Math.min(3, (width - 70) / Math.max(1, right - left), (height - 70) / Math.max(1, bottom - top));
  const transform = d3.zoomIdentity.translate(width / 2, height / 2).scale(k)
    .translate(-(left + right) / 2, -(top + bottom) / 2);
  d3.select(canvas).call(zoom.transform, transform);
  inside.moving = !inside.settled;
}

let drawRequested = false;
function drawSoon() {
  if (drawRequested) return;
  drawRequested = true;
  requestAnimationFrame(() => {
    drawRequested = false;
    if (inside !== null) drawInside();
  });
}

function picture(image) {
  let made = inside.pictures.get(image);
  if (!made) {
    made = new Image();
    made.addEventListener('load', drawSoon);
    made.src = `data:image/jpeg;base64,${thumbnails[image]}`;
    inside.pictures.set(image, made);
  }
  return made.complete && made.naturalWidth ? made : null;
}

function drawInside() {
  const context = canvas.getContext('2d');
  const ratio = window.devicePixelRatio || 1;
  const {nodes, local, transform: {k, x, y}, selected} = inside;
  const screenX = (node) => node.x * k + x, screenY = (node) => node.y * k + y;
  const ink = {edge: colour('edge'), accent: colour('accent'), warning: colour('warning'), paper: colour('raised'),
    text: colour('ink')};
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);

  const lines = (ends) => {
    for (let begin = 0; begin < ends.length; begin += 1000) {
      context.beginPath();
      for (let i = begin; i < Math.min(ends.length, begin + 1000); i += 2) {
        context.moveTo(screenX(ends[i]), screenY(ends[i]));
        context.lineTo(screenX(ends[i + 1]), screenY(ends[i + 1]));
      }
      context.stroke();
    }
  };
  // Many edges would take long to draw at every move: they follow when it has come to rest.
  const bins = inside.moving && inside.backboneBins ? inside.backboneBins : inside.bins;
  if (inside.moving && inside.settled && inside.backboneBins) {
    clearTimeout(inside.redraw);
    inside.redraw = setTimeout(() => {
      inside.moving = false;
      drawSoon();
    }, 150);
  }
  const crowd = Math.min(1, Math.sqrt(3000 / Math.max(1, d3.sum(bins, (bin) => bin.length))));
  context.strokeStyle = ink.edge;
  context.lineWidth = 1;
  const dim = selected >= 0 ? 0.35 : 1;
  bins.forEach((bin, i) => {
    context.globalAlpha = dim * (0.02 + crowd * [0.65, 0.45, 0.3, 0.2][i]);
    lines(bin);
  });
  context.globalAlpha = 1;
  context.strokeStyle = ink.warning;
  for (const [a, b] of inside.highlighted) {
    const isBridge = bridgeKeys.has(edgeKey(a, b));
    context.lineWidth = isBridge ? 3 : 2;
    context.setLineDash(isBridge ? [] : [6, 4]);
    lines([nodes[local.get(a)], nodes[local.get(b)]]);
  }
  context.setLineDash([]);

  const near = new Set();
  if (selected >= 0) {
    near.add(selected);
    const ends = [];
    for (let n = firstNeighbour[selected]; n < firstNeighbour[selected + 1]; ++n) {
      near.add(neighbours[n]);
      ends.push(nodes[local.get(selected)], nodes[local.get(neighbours[n])]);
    }
    context.strokeStyle = ink.accent;
    context.lineWidth = 2;
    lines(ends);
  }

  const radius = Math.max(1.4, Math.min(6, 4 * Math.sqrt(k)));
  const size = Math.min(64, 0.85 * linkLength * k);
  const {clientWidth: width, clientHeight: height} = canvas;
  const lit = (node) => near.size === 0 || near.has(node.image);
  const nodesInOrder = near.size ? nodes.filter((node) => !lit(node)).concat(nodes.filter(lit)) : nodes;
  for (const node of nodesInOrder) {
    const [px, py] = [screenX(node), screenY(node)];
    if (px < -40 || py < -40 || px > width + 40 || py > height + 40) continue;
    const {image} = node;
    const photo = size >= 22 && image in thumbnails && !(inside.moving && nodes.length > 500) ? picture(image) : null;
    context.globalAlpha = lit(node) ? 1 : 0.3;
    let extent = radius;
    if (photo) {
      const side = Math.min(photo.naturalWidth, photo.naturalHeight);
      context.drawImage(photo, (photo.naturalWidth - side) / 2, (photo.naturalHeight - side) / 2, side, side,
        px - size / 2, py - size / 2, size, size);
      extent = size / 2 * 1.2;
    } else {
      context.beginPath();
      context.arc(px, py, radius, 0, 2 * Math.PI);
      context.fillStyle = ink.accent;
      context.fill();
      if (radius > 2.5) {
        context.lineWidth = 1;
        context.strokeStyle = ink.paper;
        context.stroke();
      }
    }
    const ring = image === selected || image === inside.hovered ? ink.text :
      articulationPoints.has(image) ? ink.warning : null;
    if (ring) {
      context.beginPath();
      context.arc(px, py, extent + 3, 0, 2 * Math.PI);
      context.lineWidth = 2;
      context.strokeStyle = ring;
      context.stroke();
    }
  }
  context.globalAlpha = 1;
}

function imageAt([px, py]) {
  if (inside === null || !inside.settled) return -1;
  const {k, x, y} = inside.transform;
  const node = inside.tree.find((px - x) / k, (py - y) / k, Math.max(10, 0.45 * linkLength * k) / k);
  return node ? node.image : -1;
}

function select(image) {
  inside.selected = image;
  drawSoon();
}

function showTooltip(image, [px, py]) {
  const tooltip = byId('tooltip');
  tooltip.hidden = image < 0;
  if (image < 0) return;
  tooltip.replaceChildren(...[thumbnail(image, 'img.thumbnail.large'), element('p', {}, names[image]),
    element('p', {}, plural(degrees[image], 'neighbour'))].filter((part) => part !== null));
  tooltip.style.left = `${Math.max(0, Math.min(px + 14, stage.clientWidth - tooltip.offsetWidth - 4))}px`;
  tooltip.style.top = `${Math.max(0, Math.min(py + 14, stage.clientHeight - tooltip.offsetHeight - 4))}px`;
}

canvas.addEventListener('mousemove', (event) => {
  const at = [event.offsetX, event.offsetY];
  const image = imageAt(at);
  if (inside === null) return;
  showTooltip(image, at);
  canvas.style.cursor = image >= 0 ? 'pointer' : '';
  if (image !== inside.hovered) {
    inside.hovered = image;
    drawSoon();
  }
});
canvas.addEventListener('mouseleave', () => { byId('tooltip').hidden = true; });
canvas.addEventListener('click', (event) => {
  if (inside === null) return;
  const image = imageAt([event.offsetX, event.offsetY]);
  select(image);
  byId('tooltip').hidden = true;
  if (image >= 0) openPanel(image);
});
canvas.addEventListener('keydown', (event) => {
  const moves = {ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60]};
  if (inside === null || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key in moves) {
    event.preventDefault();
    const k = inside.transform.k;
    d3.select(canvas).call(zoom.translateBy, moves[event.key][0] / k, moves[event.key][1] / k);
  } else if (event.key === '+' || event.key === '-') {
    d3.select(canvas).call(zoom.scaleBy, event.key === '+' ? 1.4 : 1 / 1.4);
  }
});
byId('zoom-in').addEventListener('click', () => d3.select(canvas).call(zoom.scaleBy, 1.4));
byId('zoom-out').addEventListener('click', () => d3.select(canvas).call(zoom.scaleBy, 1 / 1.4));
byId('zoom-fit').addEventListener('click', fitView);
byId('back').addEventListener('click', goBack);

function showInGraph(image) {
  openComponent(componentOf[image], image);
  byId('graph').scrollIntoView();
}

// ---------------------------------------------------------------------------------------------------------------------
// One image: a panel at the side.

const panel = byId('panel');
let returnFocusTo = null;

function openPanel(image) {
  if (panel.hidden) returnFocusTo = document.activeElement;
  const component = componentOf[image];
  const facts = element('dl', {});
  const fact = (title, value) => facts.append(element('dt', {}, title), element('dd', {}, value));
  fact('Features', count(report.num_features[image]));
  fact('Neighbours', count(degrees[image]));
  if (component >= 0) fact('Component', `${count(component + 1)}, of ${images(components[component].length)}`);
  fact('COLMAP image_id', String(report.image_ids[image]));
  const point = articulationPoints.get(image);
  const close = element('button', {type: 'button', onclick: closePanel, 'aria-label': 'Close'}, '✕');
  panel.replaceChildren(
    element('header', {}, element('h2', {id: 'panel-name'}, names[image]), close));
  const photo = thumbnail(image, 'img.thumbnail.large');
  if (photo) panel.append(photo);
  panel.append(facts);
  if (point) {
    panel.append(element('p.warning', {}, 'Without this image its component falls apart into parts of ' +
      `${point.parts.map(count).join(', ')} images.`));
  }
  if (component >= 0) {
    panel.append(element('p', {}, element('button', {type: 'button', onclick: () => {
      closePanel();
      showInGraph(image);
    }}, 'Show in the graph')));
    const rows = [];
    for (let n = firstNeighbour[image]; n < firstNeighbour[image + 1]; ++n) rows.push(n);
    listTable(panel, [['Neighbour'], ['Inliers', true]], rows,
      (n) => [imageWithThumbnail(neighbours[n]), count(neighbourInliers[n])]);
  } else if (withoutEdge.has(image)) {
    panel.append(...explainAlone(withoutEdge.get(image)));
  }
  panel.hidden = false;
  panel.scrollTop = 0;
  close.focus();
}

function closePanel() {
  if (panel.hidden) return;
  panel.hidden = true;
  if (returnFocusTo && returnFocusTo.isConnected) returnFocusTo.focus({preventScroll: true});
}

document.addEventListener('keydown', (event) => {
  if (event.key !== 'Escape') return;
  if (!byId('hits').hidden) byId('hits').hidden = true;
  else if (!panel.hidden) closePanel();
  else if (inside !== null) goBack();
});

// ---------------------------------------------------------------------------------------------------------------------
// Search.

const search = byId('search');
const hits = byId('hits');
const lowerNames = names.map((name) => name.toLowerCase());

function showHits() {
  const wanted = search.value.trim().toLowerCase();
  hits.hidden = wanted === '';
  if (hits.hidden) return;
  const found = [];
  lowerNames.forEach((name, image) => { if (name.includes(wanted)) found.push(image); });
  hits.replaceChildren(element('p', {}, found.length === 0 ? 'No image has this in its name.' :
    `${images(found.length)}${found.length > 30 ? ', the first 30:' : ''}`));
  hits.append(...found.slice(0, 30).map((image) => element('button', {type: 'button', onclick: () => {
    hits.hidden = true;
    openPanel(image);
  }}, element('span', {}, names[image]), element('span', {}, plural(degrees[image], 'neighbour')))));
}
search.addEventListener('input', showHits);
search.addEventListener('focus', showHits);
search.addEventListener('keydown', (event) => {
  const first = hits.querySelector('button');
  if (event.key === 'Enter' && first) {
    // (Otherwise the same key would press the button that has the focus then.)
    event.preventDefault();
    first.click();
  }
  if (event.key === 'ArrowDown' && first) {
    event.preventDefault();
    first.focus();
  }
});
hits.addEventListener('keydown', (event) => {
  const step = {ArrowDown: 'nextElementSibling', ArrowUp: 'previousElementSibling'}[event.key];
  if (!step) return;
  event.preventDefault();
  const next = document.activeElement[step];
  if (next && next.tagName === 'BUTTON') next.focus();
  else if (event.key === 'ArrowUp') search.focus();
});
document.addEventListener('click', (event) => {
  if (!event.target.closest('.search')) hits.hidden = true;
});

// ---------------------------------------------------------------------------------------------------------------------
// Lists.

function showComponents() {
  const holder = byId('components-table');
  if (components.length === 0) {
    holder.append(element('p.note', {}, 'There is no component: no two images have an edge.'));
    return;
  }
  listTable(holder, [['Component', true], ['Images', true], ['Edges', true], ['Neighbours an image', true],
    ['Best connected image'], ['']], components, (component, i) => {
    const best = bestConnected(i);
    return [count(i + 1), count(component.length), count(componentEdges[i]),
      (2 * componentEdges[i] / component.length).toFixed(1), imageWithThumbnail(best),
      element('button', {type: 'button', 'aria-label': `Show component ${i + 1} in the graph`, onclick: () => {
        openComponent(i);
        byId('graph').scrollIntoView();
      }}, 'Show')];
  });
}

// Why an image may be alone, what to do about it, and its nearest candidates.
function explainAlone({image, features, failed = 0, candidates}) {
  const best = d3.max(candidates, (candidate) => candidate.inliers) || 0;
  const texts = [];
  if (features === 0) {
    texts.push('It has no features: it is blank, blurred or could not be read, and nothing can match it.');
  } else if (candidates.length === 0 && failed > 0) {
    texts.push(`COLMAP failed on ${failed === 1 ? 'the pair' : `all ${count(failed)} pairs`} with it that were ` +
      'tested: see the warnings of the run.');
  } else if (candidates.length === 0) {
    texts.push(report.finished ? 'No pair with it was tested: no list and no stage asked for one.' :
      'No pair with it was tested before the run was stopped. The same command goes on.');
  } else if (2 * best >= minInliers) {
    texts.push(`Its best pair has ${plural(best, 'inlier')} of the ${minInliers} that make an edge. A photo taken ` +
      'between the two could join them.');
  } else {
    texts.push('None of those that look most like it shares enough with it. It is the only photo of its place, or ' +
      'those that would match it look too different: more photos around it help' +
      (moreTests() ? `, or a ${moreTests()}.` : '.'));
  }
  if (features > 0 && features < 200) {
    texts.push(`It has few features (${count(features)}): little texture, blur, or a small photo.`);
  }
  const parts = texts.map((text) => element('p', {}, ...prose(text)));
  if (candidates.length > 0) {
    const known = (value, text) => (value === null || value === undefined ? '–' : text(value));
    const columns = [[['Nearest tested'], ({image: other}) => imageWithThumbnail(other)],
      [['Distance', true], ({distance}) => known(distance, (d) => d.toFixed(2))],
      [['Matches', true], ({matches}) => known(matches, count)],
      [['Inliers', true], ({inliers}) => known(inliers, count)]]
      .filter(([[title]]) => title !== 'Matches' || candidates.some(({matches}) => Number.isFinite(matches)));
    parts.push(element('div.scroll', {}, fillTable(element('table'), columns.map(([column]) => column),
      candidates.map((candidate) => columns.map(([, cell]) => cell(candidate))))));
  }
  return parts;
}

function showWithoutEdge() {
  const holder = byId('without-edge-list');
  if (withoutEdge.size === 0) {
    holder.append(element('p.note', {}, 'None: every image has an edge.'));
    return;
  }
  const cards = element('div.cards', {});
  holder.append(cards);
  showInPortions(holder, cards, report.images_without_edge, (entry) => element('article.card', {},
    element('header', {}, thumbnail(entry.image), element('div', {}, imageButton(entry.image),
      element('div.readout', {}, plural(entry.features, 'feature')))),
    ...explainAlone(entry)), 24);
}

const showButton = (image) => element('button', {type: 'button', 'aria-label': 'Show in the graph',
  onclick: () => showInGraph(image)}, 'Show');

// What the report counts but does not list, because less than two images hang on it.
const remark = (listed, all, what) => (all > listed ? element('p.note', {},
  `${listed ? 'Not listed' : 'None of this kind'}: ${plural(all - listed, what)} on which a single image hangs.`) :
  listed ? null : element('p.note', {}, 'None.'));

function showWeakPlaces() {
  if (report.bridges.length > 0) {
    listTable(byId('bridges'), [['Images on each side'], ['One end'], ['Other end'], ['Inliers', true], ['']],
      report.bridges, ({images: [a, b], inliers, sides}) => [sides.map(count).join(' | '), imageWithThumbnail(a),
        imageWithThumbnail(b), count(inliers), showButton(a)]);
  }
  byId('bridges').append(...[remark(report.bridges.length, report.num_bridges, 'bridge')].filter(Boolean));

  if (report.articulation_points.length > 0) {
    listTable(byId('articulation-points'), [['Image'], ['Parts without it (images)'], ['Neighbours', true], ['']],
      report.articulation_points, ({image, parts}) => [imageWithThumbnail(image), parts.length > 6 ?
        `${parts.slice(0, 6).map(count).join(' | ')} | … (${parts.length} parts)` : parts.map(count).join(' | '),
      count(degrees[image]), showButton(image)]);
  }
  byId('articulation-points').append(...[remark(report.articulation_points.length,
    report.num_articulation_points, 'articulation point')].filter(Boolean));

  byId('weak-links-explanation').textContent = `Edges of fewer than ${2 * minInliers} inliers which alone join two ` +
    'groups of at least three images that stronger edges hold together. They may be right; but where two places look ' +
    'alike (repeated facades, signs), such edges join what does not belong together. Look at the photos.';
  const weakEdges = [];
  report.weak_links.forEach((link, i) => link.edges.forEach((edge) => weakEdges.push([link, edge, i])));
  if (weakEdges.length > 0) {
    listTable(byId('weak-links'), [['Groups (images)'], ['One end'], ['Other end'], ['Inliers', true], ['']],
      weakEdges, ([{groups}, [a, b, inliers]]) => [groups.map(count).join(' | '), imageWithThumbnail(a),
        imageWithThumbnail(b), count(inliers), showButton(a)]);
  } else {
    byId('weak-links').append(element('p.note', {}, 'None.'));
  }
}

// ---------------------------------------------------------------------------------------------------------------------
// Degrees.

function drawDegrees() {
  const holder = byId('degree-chart');
  const box = {width: Math.max(280, holder.clientWidth), height: 240, left: 52, right: 14, top: 30, bottom: 44};
  const most = d3.max(degrees) || 0;
  const binSize = Math.ceil((most + 1) / 60);
  // The images without a neighbour have a column of their own.
  const bins = new Uint32Array(Math.ceil(most / binSize) + 1);
  for (const degree of degrees) ++bins[Math.ceil(degree / binSize)];
  const x = d3.scaleLinear([-binSize / 2, (bins.length - 1) * binSize + binSize / 2],
    [box.left, box.width - box.right]);
  const y = d3.scaleLinear([0, Math.max(1, d3.max(bins))], [box.height - box.bottom, box.top]).nice(5);
  const svg = svgFor(holder, box.width, box.height, 'Images by their number of neighbours');
  drawAxes(svg, x, y, {...box, xLabel: 'neighbours', yLabel: 'images'});
  const width = Math.max(1, (x(binSize) - x(0)) * 0.85);
  bins.forEach((number, i) => {
    const range = i === 0 || binSize === 1 ? count(i) : `${count((i - 1) * binSize + 1)} to ${count(i * binSize)}`;
    svg.append('rect').attr('class', i === 0 ? 'column none' : 'column').attr('x', x(i * binSize) - width / 2)
      .attr('width', width).attr('y', y(number)).attr('height', y(0) - y(number))
      .append('title').text(`${images(number)} with ${range} neighbours`);
  });
  const few = degrees.reduce((sum, degree) => sum + (degree > 0 && degree < 3 ? 1 : 0), 0);
  byId('degree-readout').textContent = numImages === 0 ? '' :
    `Median ${count(d3.median(degrees))}, mean ${d3.mean(degrees).toFixed(1)}, most ${count(most)}. ` +
    `${images(few)} ${few === 1 ? 'has' : 'have'} only one or two neighbours` +
    (binSize > 1 ? `. Each column counts ${binSize} numbers of neighbours.` : '.');
}

// ---------------------------------------------------------------------------------------------------------------------
// Adjacency.

function drawAdjacency() {
  const picture = byId('adjacency-picture');
  picture.hidden = numImages === 0;
  if (numImages === 0) return;
  const binned = numImages > 1000;
  const cells = binned ? 1000 : numImages;
  const position = new Uint32Array(numImages);
  seriation.forEach((image, i) => { position[image] = i; });
  const cell = (image) => Math.floor(position[image] * cells / numImages);
  const edgesIn = new Uint32Array(cells * cells);
  const testsIn = new Uint8Array(cells * cells);
  const mark = (into, a, b) => {
    ++into[cell(a) * cells + cell(b)];
    ++into[cell(b) * cells + cell(a)];
  };
  for (const [a, b] of edges) mark(edgesIn, a, b);
  const {nonedge_list: tested} = report;
  for (let i = 0; i < tested.length; i += 2) {
    testsIn[cell(tested[i]) * cells + cell(tested[i + 1])] = 1;
    testsIn[cell(tested[i + 1]) * cells + cell(tested[i])] = 1;
  }
  const rgb = (name) => {
    const {r, g, b} = d3.color(colour(name)).rgb();
    return [r, g, b];
  };
  const dark = rgb('edge'), light = rgb('tested'), none = rgb('untested');
  const full = binned ? (numImages / cells) ** 2 : 1;
  const pixels = new ImageData(cells, cells);
  for (let i = 0; i < cells * cells; ++i) {
    const base = testsIn[i] ? light : none;
    // Even one edge of a cell is seen; the darker, the more of its pairs are edges.
    const weight = edgesIn[i] ? Math.min(1, 0.35 + 0.65 * Math.sqrt(edgesIn[i] / full)) : 0;
    for (let c = 0; c < 3; ++c) pixels.data[4 * i + c] = base[c] + weight * (dark[c] - base[c]);
    pixels.data[4 * i + 3] = 255;
  }
  const small = document.createElement('canvas');
  small.width = small.height = cells;
  small.getContext('2d').putImageData(pixels, 0, 0);
  const scale = Math.ceil(1000 / cells);
  const side = cells * scale;
  picture.width = picture.height = side;
  const context = picture.getContext('2d');
  context.imageSmoothingEnabled = false;
  context.drawImage(small, 0, 0, side, side);
  context.strokeStyle = colour('frame');
  context.lineWidth = 1.5;
  let first = 0;
  for (const {length} of components) {
    const [begin, width] = [first * side / numImages, length * side / numImages];
    if (width >= 4) context.strokeRect(begin, begin, width, width);
    first += length;
  }
  picture.setAttribute('aria-label', 'Pairs of images: edges dark, other tested pairs light');

  const readout = byId('adjacency-readout');
  const width = (numImages / cells).toFixed(1);
  const rest = binned ? `Each point stands for ${width} × ${width} images.` :
    'Move over the picture to see which pair is where.';
  readout.textContent = rest;
  picture.onmousemove = (event) => {
    const at = (offset) => seriation[Math.min(numImages - 1,
      Math.max(0, Math.floor(offset / picture.clientWidth * numImages)))];
    const [a, b] = [at(event.offsetX), at(event.offsetY)];
    readout.textContent = `${names[a]} and ${names[b]}` + (a === b ? ' (the diagonal)' :
      neighbours.subarray(firstNeighbour[a], firstNeighbour[a + 1]).includes(b) ? ': an edge' :
        componentOf[a] === componentOf[b] && componentOf[a] >= 0 ?
          `: no edge; both in component ${count(componentOf[a] + 1)}` : ': no edge');
  };
  picture.onmouseleave = () => { readout.textContent = rest; };
}

function showAdjacencyLegend() {
  const drawn = report.nonedge_list.length / 2;
  const leftOut = report.nonedges_left_out || 0;
  byId('adjacency-legend').append(legendItem(swatch('edge'), 'edge'),
    legendItem(swatch('tested'), 'tested, no edge' +
      (leftOut > 0 ? ` (of ${count(drawn + leftOut)} such pairs ${count(drawn)} are drawn)` : '')),
    legendItem(element('span.swatch', {style: 'background: var(--untested); border: 1px solid var(--line)'}),
      'not tested'),
    legendItem(element('span.swatch', {style: 'border: 2px solid var(--frame)'}), 'a component'));
}

// ---------------------------------------------------------------------------------------------------------------------
// Cost.

function showCost() {
  const parts = preparation.map((name) => [name, report.seconds[name], 'preparation']);
  for (const name of stages) parts.push([name, report.stages[name].seconds, name]);
  const named = d3.sum(parts, (part) => part[1]);
  const total = Math.max(report.seconds.total, named);
  parts.push(['everything else', total - named, null]);
  for (const [name, seconds, tint] of parts) {
    if (tint && seconds > 0) {
      byId('time-bar').append(element('div', {title: `${name}: ${duration(seconds)}`,
        style: `flex: ${seconds / total} 0 0; background: ${tintOf(tint)}`}));
    }
  }
  const tints = ['preparation', ...stages];
  byId('time-legend').append(...tints.map((name) =>
    legendItem(swatch(name), name === 'preparation' ? 'Pre-processing' : capital(name))));
  byId('time-bar').append(element('div', {style: `flex: ${(total - named) / total || 0} 0 0`}));
  const table = fillTable(byId('times'), [['Part'], ['Time', true], ['Share', true]],
    parts.map(([name, seconds]) => [capital(name), duration(seconds), percent(seconds / total)]));
  const row = tableRow([[''], ['', true], ['', true]], ['All', duration(report.seconds.total), '']);
  row.className = 'total';
  table.tBodies[0].append(row);
  if (report.seconds.modelled !== undefined) {
    table.tBodies[0].append(tableRow([[''], ['', true], ['', true]],
      ['Matching as COLMAP would take it (modelled)', duration(report.seconds.modelled), '']));
  }

  const settings = [['Program', report.program], ['Strategy', report.strategy]];
  if (report.descriptor) settings.push(['Descriptor of images', report.descriptor]);
  settings.push(['Inliers of an edge, at least', count(minInliers)], ['Threads', count(report.threads)]);
  if (report.peak_memory_mb !== null) settings.push(['Peak memory', `${count(Math.round(report.peak_memory_mb))} MB`]);
  fillTable(byId('settings'), [['Setting'], ['Value', true]], settings);

  byId('iterations-details').hidden = report.iterations.length === 0;
  const rows = [];
  for (const iteration of report.iterations) {
    for (const name of ['sampling', 'propagation']) {
      const stage = iteration[name];
      if (stage.tested === 0 && stage.known === 0) continue;
      rows.push([count(iteration.iteration + 1), element('span', {}, swatch(name), capital(name)), count(stage.tested),
        count(stage.edges), stage.tested ? percent(stage.edges / stage.tested) : '–', duration(stage.seconds)]);
    }
  }
  fillTable(byId('iterations'), [['Iteration', true], ['Stage'], ['Tested', true], ['Edges', true],
    ['Efficiency', true], ['Time', true]], rows);
}

// ---------------------------------------------------------------------------------------------------------------------
// All of it: first what is seen first.

function redrawFigures() {
  drawDiscovery();
  drawDegrees();
  if (inside === null) {
    drawOverview();
  } else {
    sizeCanvas();
    fitView();
  }
}

showHeadline();
showDiscovery();
showOverview();
performance.mark('first picture');
setTimeout(() => {
  showComponents();
  showWithoutEdge();
  showWeakPlaces();
  drawDegrees();
  showAdjacencyLegend();
  showCost();
  drawAdjacency();
  performance.mark('all shown');
  document.documentElement.dataset.ready = 'true';
  // What a link to a section wants to show has only now its place.
  if (/^#[a-z-]+$/.test(location.hash)) document.querySelector(location.hash)?.scrollIntoView();
}, 0);

let resized = 0;
let lastWidth = window.innerWidth;
window.addEventListener('resize', () => {
  if (window.innerWidth === lastWidth) return;
  lastWidth = window.innerWidth;
  clearTimeout(resized);
  resized = setTimeout(redrawFigures, 100);
});
window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
  drawAdjacency();
  drawSoon();
});
})();
