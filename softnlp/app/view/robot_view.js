// The Vue side of RobotView: a box on the page whose methods the server calls. All drawing is Stage's.
import { Stage } from "softnlp-view";

export default {
  template: `<div class="softnlp-view" role="application" aria-roledescription="3-D view" tabindex="0"
    aria-label="The robot, or the parts of its moulds. Arrow keys turn the view, plus and minus zoom, Home goes back to the first view. O chooses an obstacle, Shift and the arrow keys move it." @keydown="key" style="position:relative;overflow:hidden;min-height:12rem;touch-action:none">
    <span role="status" style="position:absolute;width:1px;height:1px;overflow:hidden;clip-path:inset(50%)"></span></div>`,

  mounted() {
    try {
      this.stage = new Stage(this.$el, (name, value) => this.$emit(name, value));
    } catch (error) {
      this.$el.textContent = `The 3-D view needs WebGL, which this browser does not give: ${error.message}`;
      this.$el.style.padding = "1rem";
      return;
    }
    // Events are lost before the socket stands.
    this.waiting = setInterval(() => {
      if (window.socket?.id === undefined) return;
      clearInterval(this.waiting);
      this.$emit("ready", {});
    }, 50);
  },

  beforeUnmount() {
    clearInterval(this.waiting);
    this.stage?.dispose();
  },

  methods: {
    key(event) {
      const words = !event.ctrlKey && !event.metaKey && !event.altKey && this.moves(event);
      if (words) {
        event.preventDefault();
        this.$el.querySelector("[role=status]").textContent = words;
        return;
      }
      if (event.ctrlKey || event.metaKey || event.altKey || !this.stage?.key(event.key)) return;
      event.preventDefault();
    },
    moves({ key, shiftKey }) {
      if (key === "o" || key === "O") return this.stage?.nudge("next");
      return shiftKey && key.startsWith("Arrow") && this.stage?.nudge(key);
    },
    obstacles(message) {
      this.stage?.setObstacles(message?.obstacles ?? []);
    },
    robot(message) {
      this.stage?.setRobot(message);
    },
    show(message) {
      this.stage?.show(message);
    },
    points(message) {
      this.stage?.marks.setPoints(message);
    },
    targets(message) {
      this.stage?.marks.setTargets(message);
    },
    pins(message) {
      this.stage?.setPins(message?.pins ?? []);
    },
    parts(message) {
      this.stage?.setParts(message);
    },
    explode(share) {
      this.stage?.explode(share);
    },
    reset() {
      this.stage?.reset();
    },
    clearTrail() {
      this.stage?.marks.clearTrail();
    },
    picture() {
      return this.stage?.picture() ?? null;
    },
    download(name) {
      const link = document.createElement("a");
      link.href = this.picture();
      link.download = name;
      link.click();
    },
  },
};
