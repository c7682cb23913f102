// Pressures over time: a line for each set; a stroke of the pointer becomes a part of the active one.
const [LEFT, RIGHT, TOP, BOTTOM] = [44, 10, 10, 36];
const NEAR = 2; // px between two points of a stroke

const svg = (name, attributes, text) => {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
};

// The nearest of 1, 2, 5 times a power of ten that makes at most so many parts.
const roundStep = (span, most) => {
  const least = span / most;
  const decade = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((n) => n * decade).find((step) => step >= least * 0.999);
};

export default {
  template: `<div class="softnlp-draw" style="touch-action:none;cursor:crosshair;position:relative"></div>`,

  mounted() {
    this.sizes = new ResizeObserver(() => this.draw());
    this.sizes.observe(this.$el);
    this.$el.addEventListener("pointerdown", (event) => this.begin(event));
    this.$el.addEventListener("pointermove", (event) => this.go(event));
    for (const name of ["pointerup", "pointercancel"]) this.$el.addEventListener(name, () => this.end());
    this.waiting = setInterval(() => {
      if (window.socket?.id === undefined) return;
      clearInterval(this.waiting);
      this.$emit("ready", {});
    }, 50);
  },

  beforeUnmount() {
    clearInterval(this.waiting);
    this.sizes.disconnect();
  },

  methods: {
    show(message) {
      this.message = message;
      this.draw();
    },

    // Where a time and a pressure are on the picture, and back.
    place([t, p]) {
      const { duration, top } = this.message;
      const [w, h] = [this.$el.clientWidth - LEFT - RIGHT, this.$el.clientHeight - TOP - BOTTOM];
      return [LEFT + (t / duration) * w, TOP + (1 - p / top) * h];
    },
    read(event) {
      const box = this.$el.getBoundingClientRect();
      const { duration, top } = this.message;
      const [w, h] = [box.width - LEFT - RIGHT, box.height - TOP - BOTTOM];
      const t = ((event.clientX - box.left - LEFT) / w) * duration;
      const p = (1 - (event.clientY - box.top - TOP) / h) * top;
      return [Math.min(Math.max(t, 0), duration), Math.min(Math.max(p, 0), top)];
    },

    begin(event) {
      if (event.button !== 0 || !this.message) return;
      this.$el.setPointerCapture(event.pointerId);
      this.stroke = [this.read(event)];
      this.at = event;
    },
    go(event) {
      if (!this.stroke) return;
      if (Math.hypot(event.clientX - this.at.clientX, event.clientY - this.at.clientY) < NEAR) return;
      this.at = event;
      const next = this.read(event);
      // A stroke goes one way in time: what is drawn over again is replaced.
      const way = Math.sign(next[0] - this.stroke[0][0]) || 1;
      this.stroke = this.stroke.filter(([t], k) => k === 0 || (next[0] - t) * way >= 0);
      this.stroke.push(next);
      this.draw();
    },
    end() {
      const points = this.stroke;
      this.stroke = undefined;
      if (points?.length > 1) this.$emit("drawn", { points });
      else this.draw();
    },

    draw() {
      const { clientWidth: width, clientHeight: height } = this.$el;
      if (!this.message || width === 0) return;
      const { curves, colours, duration, top, active } = this.message;
      const words = `Pressure over time. Set ${active + 1} is drawn with the pointer; the table below has the same numbers.`;
      const picture = svg("svg", { width, height, role: "img", "aria-label": words, style: "display:block" });
      const text = { fill: "currentColor", "font-size": 12 };
      const grid = { stroke: "currentColor", "stroke-opacity": 0.2, "stroke-width": 1 };
      const t = roundStep(duration, 5);
      for (let at = 0; at <= duration * 1.0001; at += t) {
        const [x] = this.place([at, 0]);
        picture.append(svg("line", { ...grid, x1: x, x2: x, y1: TOP, y2: height - BOTTOM }));
        const label = `${Number(at.toPrecision(6))}`;
        picture.append(svg("text", { ...text, x, y: height - BOTTOM + 14, "text-anchor": "middle" }, label));
      }
      const p = roundStep(top, 4);
      for (let at = 0; at <= top * 1.0001; at += p) {
        const [, y] = this.place([0, at]);
        picture.append(svg("line", { ...grid, x1: LEFT, x2: width - RIGHT, y1: y, y2: y }));
        const label = `${Number(at.toPrecision(6))}`;
        picture.append(svg("text", { ...text, x: LEFT - 6, y: y + 4, "text-anchor": "end" }, label));
      }
      const middle = (LEFT + width - RIGHT) / 2;
      picture.append(svg("text", { ...text, x: middle, y: height - 4, "text-anchor": "middle" }, "t [s]"));
      const side = { x: 12, y: height / 2, "text-anchor": "middle", transform: `rotate(-90 12 ${height / 2})` };
      picture.append(svg("text", { ...text, ...side }, "pressure [bar]"));
      const order = curves.map((_, k) => k).filter((k) => k !== active);
      for (const k of [...order, active]) {
        const points = curves[k] ?? [];
        if (points.length === 0) continue;
        const held = [...points, [duration, points[points.length - 1][1]]].filter(([at]) => at <= duration * 1.0001);
        const line = { fill: "none", stroke: colours[k], "stroke-width": k === active ? 3 : 1.5, "stroke-linejoin": "round" };
        picture.append(svg("polyline", { ...line, points: held.map((one) => this.place(one).join()).join(" ") }));
        if (k !== active || points.length > 80) continue;
        for (const one of points) {
          const [cx, cy] = this.place(one);
          picture.append(svg("circle", { cx, cy, r: 3.5, fill: colours[k] }));
        }
      }
      if (this.stroke) {
        const line = { fill: "none", stroke: "currentColor", "stroke-width": 2, "stroke-dasharray": "5 4" };
        picture.append(svg("polyline", { ...line, points: this.stroke.map((one) => this.place(one).join()).join(" ") }));
      }
      this.$el.replaceChildren(picture);
    },
  },
};
