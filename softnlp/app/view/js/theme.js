// Colours of the view that are not those of chamber sets, for a light and a dark page.
export const LIGHT = {
  background: "#f6f7f9",
  ink: "#222222",
  grey: "#5d646e",
  grid: "#d3d7dd",
  gridStrong: "#b3b9c2",
  plate: "#aeb4bd",
  silicone: "#e6dfd2",
  rim: "#6d6a64",
  idle: "#f2f2f2",
  ghost: "#8d95a1",
  obstacle: "#2f7fb8",
  chosen: "#b4530a",
  halo: "rgba(246,247,249,0.85)",
};
export const DARK = {
  background: "#14171b",
  ink: "#eceff3",
  grey: "#a2a9b3",
  grid: "#2c323a",
  gridStrong: "#46505c",
  plate: "#4a525d",
  silicone: "#b9b4aa",
  rim: "#f1ede4",
  idle: "#3a3f46",
  ghost: "#98a2af",
  obstacle: "#56b4e9",
  chosen: "#f0a35e",
  halo: "rgba(20,23,27,0.85)",
};

// Quasar marks a dark page on its body; the callback is called whenever that changes.
export function followTheme(changed) {
  const current = () => (document.body.classList.contains("body--dark") ? DARK : LIGHT);
  let last = current();
  const observer = new MutationObserver(() => {
    if (current() === last) return;
    last = current();
    changed(last);
  });
  observer.observe(document.body, { attributes: true, attributeFilter: ["class"] });
  return { theme: last, stop: () => observer.disconnect() };
}
