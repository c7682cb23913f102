// The Vue side of RobotView: a box on the page whose methods the server calls. All drawing is Stage's.
import { Stage } from "softnlp-view";

export default {
  template: `<div class="softnlp-view" role="img" aria-label="3-D view of the robot" style="position:relative;overflow:hidden;min-height:12rem;touch-action:none"></div>`,

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
