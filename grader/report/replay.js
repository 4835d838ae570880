"use strict";
// Plays the seconds around a failure: each figure with data-replay gets a map, a button, a slider and a clock.
// The data are numbers only (replay.py). Without this script the figure shows its picture.
const SVG = "http://www.w3.org/2000/svg";
const WORDS = { play: "Play", pause: "Pause", time: "simulated time", commanded: "commanded {v}", ahead: "{d} m ahead",
  point: ".", ...document.currentScript.dataset };
const fixed = value => value.toFixed(2).replace(".", WORDS.point);

function make(parent, kind, attributes) {
  const element = document.createElementNS(SVG, kind);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return parent.appendChild(element);
}

function drawMap(data, label) {
  const [left, low, width, height] = data.box;
  const svg = document.createElementNS(SVG, "svg");
  for (const [name, value] of Object.entries({ viewBox: `${left} ${-low - height} ${width} ${height}`, role: "img",
    "aria-label": label, class: "map" })) svg.setAttribute(name, value);
  const up = make(svg, "g", { transform: "scale(1,-1)" });
  const shapes = data.shapes.map(s => s.length === 3
    ? make(up, "circle", { class: "obstacle", cx: s[0], cy: s[1], r: s[2] })
    : make(up, "polygon", { class: "obstacle", points: s.join(" ") }));
  for (const [x, y, tolerance] of data.goals) {
    make(up, "circle", { class: "goal", cx: x, cy: y, r: 0.05 });
    make(up, "circle", { class: "tolerance", cx: x, cy: y, r: tolerance });
  }
  make(up, "polyline", { class: "way", points: data.x.map((x, i) => `${x},${data.y[i]}`).join(" ") });
  const driven = make(up, "polyline", { class: "driven" });
  const robot = make(up, "g", { class: "robot" });
  make(robot, "circle", { r: data.radius });
  make(robot, "line", { x2: data.radius });
  const touches = data.touches.map(([t, x, y]) => [t, make(up, "path", { class: "touch",
    d: `M${x - 0.09} ${y - 0.09}l.18 .18m0 -.18l-.18 .18` })]);
  return { svg, shapes, driven, robot, touches };
}

function addReplay(figure) {
  const data = JSON.parse(figure.dataset.replay), last = data.t.length - 1;
  const { svg, shapes, driven, robot, touches } = drawMap(data, figure.dataset.label);
  const controls = document.createElement("div"), play = document.createElement("button");
  const slider = document.createElement("input"), clock = document.createElement("output");
  controls.className = "controls";
  Object.assign(play, { type: "button", textContent: WORDS.play });
  Object.assign(slider, { type: "range", min: 0, max: last, step: 1 });
  slider.setAttribute("aria-label", WORDS.time);
  controls.append(play, slider, clock);
  figure.querySelector("figcaption").before(svg, controls);

  let playing = false, frame = 0, begun = 0;
  function show(index) {
    frame = index;
    const t = data.t[index], ahead = data.ahead[index];
    robot.setAttribute("transform", `translate(${data.x[index]},${data.y[index]}) rotate(${data.yaw[index] * 180 / Math.PI})`);
    driven.setAttribute("points", data.x.slice(0, index + 1).map((x, i) => `${x},${data.y[i]}`).join(" "));
    shapes.forEach((shape, i) => shape.classList.toggle("gone",
      t < data.since[i] || (data.until[i] !== null && data.until[i] <= t)));
    for (const [at, mark] of touches) mark.classList.toggle("gone", at > t + 1e-9);
    slider.value = index;
    const words = [`${fixed(t)} s`, `${fixed(data.v[index])} m/s`];
    if (data.command[index] !== null) words.push(WORDS.commanded.replace("{v}", fixed(data.command[index])));
    if (ahead !== null) words.push(WORDS.ahead.replace("{d}", fixed(ahead)));
    clock.textContent = words.join(" · ");
    slider.setAttribute("aria-valuetext", clock.textContent);
  }
  function setPlaying(on) {
    playing = on;
    play.textContent = on ? WORDS.pause : WORDS.play;
    if (!on) return;
    if (frame >= last) show(0);
    begun = performance.now() - 1000 * (data.t[frame] - data.t[0]);
    requestAnimationFrame(tick);
  }
  function tick(now) {
    if (!playing) return;
    const t = data.t[0] + (now - begun) / 1000;
    let index = frame;
    while (index < last && data.t[index + 1] <= t) index++;
    if (index !== frame) show(index);
    if (index >= last) setPlaying(false); else requestAnimationFrame(tick);
  }
  play.onclick = () => setPlaying(!playing);
  slider.oninput = () => { setPlaying(false); show(Number(slider.value)); };
  const failed = data.at === null ? last : data.t.findIndex(t => t >= data.at);
  show(failed < 0 ? last : failed);
}

document.querySelectorAll("figure[data-replay]").forEach(addReplay);

// What is folded is printed, too.
let folded = [];
addEventListener("beforeprint", () => {
  folded = [...document.querySelectorAll("details:not([open])")];
  for (const details of folded) details.open = true;
});
addEventListener("afterprint", () => { for (const details of folded) details.open = false; });
