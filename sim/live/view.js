// The browser side of the live view, for anywidget. sim/live/protocol.py defines the messages. No imports.

const NO_RANGE = 65535;
const RATES = [0.25, 0.5, 1, 2, 5, 10, null]; // null: as fast as possible
const CLICK_PX = 5; // a pointer that moved less than this has clicked
const DRAG_MS = 100; // how often the position of a dragged obstacle is sent
const ALIVE_MS = 4000;
const SILENT_MS = 8000;
const SILENT = "The kernel does not answer: it is busy, or it was restarted. In that case run this cell again.";
const LEGEND = [
  ["path", "robot and path", "lv-thin"], ["scan", "lidar"], ["goal", "goal"],
  ["obstacle", "obstacle"], ["mover", "moves by itself"], ["contact", "contact"],
];

function make(kind, attributes = {}, ...children) {
  const element = document.createElement(kind);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

const metres = (v, digits = 2) => (v === null ? "–" : v.toFixed(digits));
const mix = (a, b, k) => a + (b - a) * k;
const turn = (a, b, k) => a + Math.atan2(Math.sin(b - a), Math.cos(b - a)) * k;

/** The map in metres, y upwards, on a canvas in pixels. */
class Plan {
  constructor(canvas) {
    this.canvas = canvas;
    this.ctx = canvas.getContext("2d");
    this.bounds = [-1, -1, 1, 1];
    this.width = 0;
  }

  fit() {
    const [x0, y0, x1, y1] = this.bounds;
    const width = this.canvas.clientWidth || 640;
    const height = Math.round(Math.min(520, Math.max(200, (width * (y1 - y0)) / (x1 - x0))));
    const ratio = window.devicePixelRatio || 1;
    if (width !== this.width || height !== this.height || ratio !== this.ratio) {
      Object.assign(this, { width, height, ratio });
      this.canvas.style.height = `${height}px`;
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    this.scale = Math.min(width / (x1 - x0), height / (y1 - y0));
    this.left = (width - this.scale * (x1 - x0)) / 2 - this.scale * x0;
    this.base = (height + this.scale * (y1 - y0)) / 2 + this.scale * y0;
  }

  /** Extend the map when the robot leaves it. */
  include(x, y, margin) {
    const [x0, y0, x1, y1] = this.bounds;
    if (x - margin < x0 || y - margin < y0 || x + margin > x1 || y + margin > y1) {
      const more = 2 * margin;
      this.bounds = [Math.min(x0, x - more), Math.min(y0, y - more), Math.max(x1, x + more), Math.max(y1, y + more)];
    }
  }

  px(x) { return this.left + this.scale * x; }
  py(y) { return this.base - this.scale * y; }
  place(event) {
    const box = this.canvas.getBoundingClientRect();
    return [(event.clientX - box.left - this.left) / this.scale, (this.base - (event.clientY - box.top)) / this.scale];
  }
}

/** Whether a point, relative to an obstacle's centre, lies on one of its parts. */
function covers(parts, x, y) {
  return parts.some((p) => {
    if (p.length === 3) return Math.hypot(x - p[0], y - p[1]) <= p[2];
    let inside = p.length >= 6;
    for (let i = 0; inside && i < p.length; i += 2) {
      const j = (i + 2) % p.length;
      inside = (p[j] - p[i]) * (y - p[i + 1]) - (p[j + 1] - p[i + 1]) * (x - p[i]) >= 0;
    }
    return inside;
  });
}

class View {
  constructor(model, el) {
    this.model = model;
    this.id = Math.random().toString(36).slice(2);
    this.obstacles = new Map();
    this.path = [];
    this.contacts = [];
    this.arrivals = [];
    this.gap = 50; // ms between messages
    this.cursor = null; // the keyboard's position on the map
    this.held = null; // { name, x, y, dx, dy } while an obstacle is dragged or carried
    this.noted = 0;
    this.asked = null; // when the kernel was asked for something that it has not answered yet
    this.build(el);
    this.listen();
    this.say("Waiting for the kernel …");
    this.send({ kind: "hello", view: this.id });
  }

  // ------------------------------------------------------------------------------------------------ page

  build(el) {
    this.run = make("button", { type: "button", class: "lv-run" }, "Run");
    this.step = make("button", { type: "button" }, "Step");
    this.reset = make("button", { type: "button", title: "go back to the start" }, "Reset");
    const options = RATES.map((r) => make("option", { value: String(r) }, r === null ? "max" : `${r}×`));
    this.rate = make("select", { "aria-label": "speed: simulated time per real time" }, ...options);
    this.clock = make("span", { class: "lv-clock" }, "–");
    this.canvas = make("canvas", { class: "lv-map", tabindex: "0", role: "application" });
    this.values = {};
    const under = make("div", { class: "lv-under" });
    for (const [key, label, unit] of [["v", "speed", "m/s"], ["w", "turn", "rad/s"], ["c", "clearance", "m"], ["at", "pointer", "m"]]) {
      this.values[key] = make("span", { class: "lv-value" }, "–");
      under.append(make("span", {}, `${label} `, this.values[key], ` ${unit}`));
    }
    this.touch = make("span", {}, "no contacts");
    under.append(this.touch);
    this.legend = make("ul", { class: "lv-legend", "aria-label": "legend" });
    this.status = make("p", { class: "lv-note", role: "status", "aria-live": "polite" });
    const help = make("p", { class: "lv-help", id: `lv-${this.id}` },
      "Click the map to send a goal; drag a box, circle or polygon. With the keyboard, on the map: arrows move a cross (Shift: finely), " +
      "Enter sends the goal, M picks up and puts down the obstacle under the cross, Space runs and pauses.");
    this.canvas.setAttribute("aria-describedby", help.id);
    // JupyterLab has shortcuts on plain letters and arrows; here they belong to the view.
    this.root = make("div", { class: "lv", role: "group", "data-lm-suppress-shortcuts": "true" },
      make("div", { class: "lv-bar" }, this.run, this.step, this.reset, make("label", {}, "Speed ", this.rate), this.clock),
      this.canvas, under, this.legend, this.status, help);
    el.append(this.root);
    this.plan = new Plan(this.canvas);
    this.root.dataset.frames = this.root.dataset.drawn = "0";
  }

  listen() {
    this.onMessage = (content, buffers) => this.take(content, buffers);
    this.model.on("msg:custom", this.onMessage);
    this.run.onclick = () => this.toggle();
    this.step.onclick = () => this.send({ kind: "step" });
    this.reset.onclick = () => this.send({ kind: "reset" });
    this.rate.onchange = () => this.send({ kind: "rate", value: this.rate.value === "null" ? null : Number(this.rate.value) });
    this.canvas.onpointerdown = (e) => this.press(e);
    this.canvas.onpointermove = (e) => this.hover(e);
    this.canvas.onpointerup = (e) => this.release(e);
    this.canvas.onpointercancel = () => { this.held = this.pressed = null; this.redraw(); };
    this.canvas.onpointerleave = () => { this.values.at.textContent = "–"; };
    this.canvas.onkeydown = (e) => this.key(e);
    this.canvas.onblur = () => { this.cursor = null; this.redraw(); };
    this.resized = new ResizeObserver(() => this.redraw());
    this.resized.observe(this.canvas);
    this.themed = new MutationObserver(() => { this.palette = null; this.redraw(); });
    this.themed.observe(document.body, { attributes: true, attributeFilter: ["class", "data-jp-theme-light", "data-jp-theme-name"] });
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this.onDark = () => { this.palette = null; this.redraw(); };
    this.dark.addEventListener("change", this.onDark);
    this.beat = () => {
      this.send({ kind: "alive", view: this.id, hidden: document.hidden });
      const since = this.asked ?? (this.now?.status === "running" ? this.arrived : Infinity);
      if (performance.now() - since > SILENT_MS) this.say(SILENT);
    };
    this.alive = setInterval(this.beat, ALIVE_MS);
    document.addEventListener("visibilitychange", this.beat);
  }

  close() {
    clearInterval(this.alive);
    document.removeEventListener("visibilitychange", this.beat);
    cancelAnimationFrame(this.request);
    this.resized.disconnect();
    this.themed.disconnect();
    this.dark.removeEventListener("change", this.onDark);
    this.model.off("msg:custom", this.onMessage);
    this.send({ kind: "bye", view: this.id });
  }

  send(content) {
    if (content.kind !== "alive" && content.kind !== "bye") this.asked ??= performance.now();
    try { this.model.send(content); } catch { /* the kernel is gone, and the page itself says so */ }
  }

  say(text) { this.status.textContent = text; }

  toggle() { this.send({ kind: this.now?.status === "running" ? "pause" : "run" }); }

  // ------------------------------------------------------------------------------------------------ messages

  take(message, buffers) {
    if (message.scene) this.begin(message.scene);
    if (!this.scene) return; // another view's increments
    for (const o of message.new ?? []) this.obstacles.set(o.name, o);
    for (const [name, at] of Object.entries(message.moved ?? {})) this.obstacles.get(name).at = at;
    for (const name of message.gone ?? []) this.obstacles.delete(name);
    if (message.path) {
      this.path.length = 2 * message.path[0];
      for (let i = 1; i < message.path.length; i++) this.path.push(message.path[i]);
    }
    if (message.contacts) this.contacts.push(...message.contacts);
    this.scan = this.hits(message, buffers[0]);
    this.asked = null;
    const time = performance.now();
    if (this.now) this.gap = Math.min(250, Math.max(10, mix(this.gap, time - this.arrived, 0.2)));
    this.before = message.scene || !this.now ? message : { ...this.now, pose: this.shownPose(time) };
    this.now = message;
    this.arrived = time;
    this.plan.include(message.pose[0], message.pose[1], 2 * this.scene.radius);
    this.report(message, time);
    this.redraw();
  }

  begin(scene) {
    this.scene = scene;
    this.obstacles.clear();
    this.path = [];
    this.contacts = [];
    this.before = this.now = null;
    this.plan.bounds = scene.bounds.slice();
    this.root.setAttribute("aria-label", `live view of ${scene.world}`);
    this.canvas.setAttribute("aria-label", `map of ${scene.world}${scene.title ? `: ${scene.title}` : ""}`);
    this.step.title = `advance by ${scene.step_s} s of simulated time`;
    this.root.style.setProperty("--lv-contact", scene.colors.contact);
    this.legend.replaceChildren(...LEGEND.map(([name, label, thin]) => {
      const mark = make("i", thin ? { class: thin } : {});
      mark.style.background = scene.colors[name];
      return make("li", {}, mark, label);
    }));
  }

  hits(message, buffer) {
    const ranges = new DataView(buffer.buffer ?? buffer, buffer.byteOffset ?? 0, buffer.byteLength);
    const [x, y, yaw] = message.sensor;
    const points = [];
    for (let i = 0; 2 * i < ranges.byteLength; i++) {
      const r = ranges.getUint16(2 * i, true), a = yaw + this.scene.angle_min + i * this.scene.increment;
      points.push(r === NO_RANGE ? null : [x + (r / 100) * Math.cos(a), y + (r / 100) * Math.sin(a)]);
    }
    return points;
  }

  report(m, time) {
    this.arrivals.push(time);
    while (this.arrivals[0] < time - 1000) this.arrivals.shift();
    const running = m.status === "running";
    this.run.textContent = running ? "Pause" : "Run";
    for (const button of [this.run, this.step, this.reset, this.rate]) button.disabled = m.status === "stopped";
    if (document.activeElement !== this.rate) this.showRate(m.rate);
    this.clock.textContent = `${m.t.toFixed(2)} s simulated` + (running ? `, ${m.speed.toFixed(1)}× real time, ${this.arrivals.length} fps` : `, ${m.status}`);
    this.values.v.textContent = metres(m.twist[0]);
    this.values.w.textContent = metres(m.twist[1]);
    this.values.c.textContent = metres(m.clearance);
    const last = this.contacts.at(-1), n = this.contacts.length;
    this.touch.textContent = n ? `${n} contact${n > 1 ? "s" : ""}, last: ${last[3]} at ${last[2].toFixed(2)} s` : "no contacts";
    this.touch.className = m.touching ? "lv-bad" : "";
    const [number, text] = m.note;
    if (number !== this.noted || this.status.textContent.startsWith("Waiting") || this.status.textContent === SILENT) {
      this.noted = number;
      this.say(text);
      this.status.className = m.status === "failed" ? "lv-note lv-bad" : "lv-note";
    }
    Object.assign(this.root.dataset, {
      frames: Number(this.root.dataset.frames) + 1, time: m.t, status: m.status, rate: String(m.rate),
      pose: m.pose.join(" "), goal: (m.goal ?? []).join(" "), fps: this.arrivals.length,
    });
  }

  showRate(rate) {
    const value = String(rate);
    if (![...this.rate.options].some((o) => o.value === value)) this.rate.append(make("option", { value }, `${rate}×`));
    this.rate.value = value;
  }

  // ------------------------------------------------------------------------------------------------ pointer and keys

  under([x, y]) {
    for (const o of [...this.obstacles.values()].reverse())
      if (o.drag && covers(o.parts, x - o.at[0], y - o.at[1])) return o;
    return null;
  }

  hold(obstacle, [x, y]) {
    this.held = { name: obstacle.name, x: obstacle.at[0], y: obstacle.at[1], dx: obstacle.at[0] - x, dy: obstacle.at[1] - y, sent: 0 };
  }

  carry([x, y], last = false) {
    const h = this.held;
    Object.assign(h, { x: x + h.dx, y: y + h.dy });
    const time = performance.now();
    if (last || time - h.sent >= DRAG_MS) {
      h.sent = time;
      this.send({ kind: "move", name: h.name, x: h.x, y: h.y });
    }
    if (last) {
      // Keep the obstacle under the pointer until the next frames bring its true position.
      const released = this.held;
      setTimeout(() => { if (this.held === released) { this.held = null; this.redraw(); } }, 250);
    }
    this.redraw();
  }

  press(event) {
    if (!this.scene || event.button !== 0) return;
    this.canvas.setPointerCapture(event.pointerId);
    const place = this.plan.place(event);
    this.pressed = [event.clientX, event.clientY];
    const obstacle = this.under(place);
    if (obstacle) this.hold(obstacle, place);
  }

  hover(event) {
    if (!this.scene) return;
    const place = this.plan.place(event);
    this.values.at.textContent = `${metres(place[0])}, ${metres(place[1])}`;
    if (this.pressed && this.held) this.carry(place);
    this.canvas.style.cursor = this.held ? "grabbing" : this.under(place) ? "grab" : "crosshair";
  }

  release(event) {
    if (!this.pressed) return;
    const moved = Math.hypot(event.clientX - this.pressed[0], event.clientY - this.pressed[1]);
    this.pressed = null;
    const place = this.plan.place(event);
    if (this.held && moved >= CLICK_PX) this.carry(place, true);
    else if (this.held) this.held = null;
    else if (moved < CLICK_PX) this.goal(place);
  }

  goal([x, y]) { this.send({ kind: "goal", x, y }); }

  key(event) {
    if (!this.scene || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = event.shiftKey ? 0.05 : 0.25;
    const move = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] }[event.key];
    const here = this.cursor ?? [this.now.pose[0], this.now.pose[1]];
    if (move) {
      this.cursor = [here[0] + move[0], here[1] + move[1]];
      this.plan.include(...this.cursor, 0.1);
      this.values.at.textContent = `${metres(this.cursor[0])}, ${metres(this.cursor[1])}`;
      if (this.held) this.carry(this.cursor);
    } else if (event.key === "Enter") this.goal(here);
    else if (event.key === " ") this.toggle();
    else if (event.key.toLowerCase() === "m") {
      if (this.held) this.carry(here, true);
      else {
        const obstacle = this.under(here);
        if (obstacle) this.hold(obstacle, here);
        this.say(obstacle ? `${obstacle.name} picked up` : "nothing under the cross to pick up");
      }
    } else if (event.key === "Escape") this.held = this.cursor = null;
    else return;
    event.preventDefault();
    event.stopPropagation();
    this.redraw();
  }

  // ------------------------------------------------------------------------------------------------ picture

  redraw() {
    this.request ??= requestAnimationFrame((time) => {
      this.request = null;
      if (!this.scene || !this.now || !this.canvas.isConnected) return;
      this.draw(time);
      this.root.dataset.drawn = Number(this.root.dataset.drawn) + 1;
      if (time - this.arrived < this.gap) this.redraw(); // still gliding to the newest position
    });
  }

  /** Where to draw the robot: between two messages it glides from the previous position to the newest. */
  shownPose(time) {
    const k = Math.max(0, Math.min(1, (time - this.arrived) / this.gap));
    const a = this.before.pose, b = this.now.pose;
    if (k === 1 || Math.hypot(b[0] - a[0], b[1] - a[1]) > 0.5) return b;
    return [mix(a[0], b[0], k), mix(a[1], b[1], k), turn(a[2], b[2], k)];
  }

  colors() {
    if (!this.palette) {
      const style = getComputedStyle(this.root);
      const probe = make("span");
      this.root.append(probe);
      const read = (name) => { probe.style.color = `var(${name})`; return getComputedStyle(probe).color; };
      this.palette = { back: read("--lv-back"), text: read("--lv-text"), faint: read("--lv-faint"), grid: read("--lv-grid"), font: style.fontFamily };
      probe.remove();
    }
    return { ...this.scene.colors, ...this.palette };
  }

  draw(time) {
    const { plan } = this, { ctx } = plan, colors = this.colors();
    plan.fit();
    ctx.setTransform(plan.ratio, 0, 0, plan.ratio, 0, 0);
    ctx.fillStyle = colors.back;
    ctx.fillRect(0, 0, plan.width, plan.height);
    const pose = this.shownPose(time);
    this.drawGrid(ctx, colors);
    this.drawScan(ctx, colors, pose);
    this.drawPath(ctx, colors, pose);
    for (const o of this.obstacles.values()) this.drawObstacle(ctx, colors, o);
    this.drawHits(ctx, colors);
    this.drawRobot(ctx, colors, pose);
    this.scene.goals.forEach(([x, y], i) => this.drawGoal(ctx, colors, x, y, String(i + 1)));
    if (this.now.goal) this.drawGoal(ctx, colors, ...this.now.goal, "");
    for (const [x, y] of this.contacts) this.drawCross(ctx, colors.contact, x, y, 6, Math.PI / 4, 3);
    if (this.cursor) this.drawCross(ctx, colors.text, ...this.cursor, 9, 0, 1.5);
    this.drawScale(ctx, colors);
  }

  drawGrid(ctx, colors) {
    const { plan } = this;
    ctx.strokeStyle = colors.grid;
    ctx.lineWidth = 1;
    ctx.beginPath();
    const rungs = (from, to, put) => { for (let i = Math.ceil(from); i <= to; i++) put(Math.round(i)); };
    rungs(-plan.left / plan.scale, (plan.width - plan.left) / plan.scale, (x) => { ctx.moveTo(plan.px(x), 0); ctx.lineTo(plan.px(x), plan.height); });
    rungs((plan.base - plan.height) / plan.scale, plan.base / plan.scale, (y) => { ctx.moveTo(0, plan.py(y)); ctx.lineTo(plan.width, plan.py(y)); });
    ctx.stroke();
  }

  drawScan(ctx, colors, [x, y]) {
    const { plan } = this;
    ctx.beginPath();
    if (!this.scene.full_circle) ctx.moveTo(plan.px(x), plan.py(y));
    for (const p of this.scan) ctx.lineTo(plan.px(p ? p[0] : x), plan.py(p ? p[1] : y));
    ctx.closePath();
    ctx.globalAlpha = 0.14;
    ctx.fillStyle = colors.scan;
    ctx.fill();
    ctx.globalAlpha = 1;
  }

  drawHits(ctx, colors) {
    const { plan } = this;
    ctx.fillStyle = colors.scan;
    for (const p of this.scan) if (p) ctx.fillRect(plan.px(p[0]) - 1.75, plan.py(p[1]) - 1.75, 3.5, 3.5);
  }

  drawPath(ctx, colors, [x, y]) {
    const { plan, path } = this;
    ctx.beginPath();
    for (let i = 0; i < path.length; i += 2) ctx.lineTo(plan.px(path[i]), plan.py(path[i + 1]));
    if (this.now.status !== "running") ctx.lineTo(plan.px(x), plan.py(y));
    ctx.strokeStyle = colors.path;
    ctx.lineWidth = 2.5;
    ctx.lineJoin = "round";
    ctx.stroke();
  }

  drawObstacle(ctx, colors, o) {
    const { plan } = this, held = this.held?.name === o.name;
    const [x, y] = held ? [this.held.x, this.held.y] : o.at;
    ctx.fillStyle = ctx.strokeStyle = o.moves ? colors.mover : colors.obstacle;
    ctx.lineWidth = 3;
    for (const p of o.parts) {
      ctx.beginPath();
      if (p.length === 3) ctx.arc(plan.px(x + p[0]), plan.py(y + p[1]), p[2] * plan.scale, 0, 7);
      else for (let i = 0; i < p.length; i += 2) ctx.lineTo(plan.px(x + p[i]), plan.py(y + p[i + 1]));
      if (p.length === 4) { ctx.stroke(); continue; }
      ctx.closePath();
      ctx.fill();
      if (held) { ctx.save(); ctx.strokeStyle = colors.text; ctx.lineWidth = 2; ctx.setLineDash([5, 3]); ctx.stroke(); ctx.restore(); }
    }
  }

  drawGoal(ctx, colors, x, y, label) {
    const { plan } = this, u = plan.px(x), v = plan.py(y);
    ctx.fillStyle = ctx.strokeStyle = colors.goal;
    ctx.beginPath();
    for (let i = 0; i < 10; i++) {
      const r = i % 2 ? 3.8 : 9, a = Math.PI / 2 + (i * Math.PI) / 5;
      ctx.lineTo(u + r * Math.cos(a), v - r * Math.sin(a));
    }
    ctx.closePath();
    ctx.fill();
    ctx.font = `12px ${colors.font}`;
    ctx.fillText(label, u + 10, v - 4);
    if (!label) { // a clicked goal
      ctx.lineWidth = 2;
      ctx.beginPath();
      ctx.arc(u, v, 13, 0, 7);
      ctx.stroke();
    }
  }

  drawRobot(ctx, colors, [x, y, yaw]) {
    const { plan } = this, u = plan.px(x), v = plan.py(y), r = Math.max(5, this.scene.radius * plan.scale);
    ctx.fillStyle = colors.back;
    ctx.strokeStyle = this.now.touching ? colors.contact : colors.path;
    ctx.lineWidth = 2.5;
    ctx.beginPath();
    ctx.arc(u, v, r, 0, 7);
    ctx.fill();
    ctx.stroke();
    ctx.beginPath();
    ctx.moveTo(u, v);
    ctx.lineTo(u + r * Math.cos(yaw), v - r * Math.sin(yaw));
    ctx.stroke();
  }

  drawCross(ctx, color, x, y, size, angle, width) {
    const { plan } = this, u = plan.px(x), v = plan.py(y);
    ctx.strokeStyle = color;
    ctx.lineWidth = width;
    ctx.beginPath();
    for (const a of [angle, angle + Math.PI / 2]) {
      ctx.moveTo(u - size * Math.cos(a), v - size * Math.sin(a));
      ctx.lineTo(u + size * Math.cos(a), v + size * Math.sin(a));
    }
    ctx.stroke();
  }

  drawScale(ctx, colors) {
    const { plan } = this, x = 12, y = plan.height - 10;
    ctx.font = `12px ${colors.font}`;
    const width = plan.scale + 30;
    ctx.globalAlpha = 0.8;
    ctx.fillStyle = colors.back;
    ctx.fillRect(x - 5, y - 14, width + 8, 20);
    ctx.globalAlpha = 1;
    ctx.strokeStyle = ctx.fillStyle = colors.text;
    ctx.lineWidth = 2;
    ctx.beginPath();
    ctx.moveTo(x, y - 6); ctx.lineTo(x, y); ctx.lineTo(x + plan.scale, y); ctx.lineTo(x + plan.scale, y - 6);
    ctx.stroke();
    ctx.fillText("1 m", x + plan.scale + 6, y + 1);
  }
}

export default {
  render({ model, el }) {
    const view = new View(model, el);
    return () => view.close();
  },
};
