// Dark and light, by the system or by the button.
export function theme(changed = () => {}) {
  const system = matchMedia("(prefers-color-scheme: dark)"), root = document.documentElement;
  document.querySelector("#theme").addEventListener("click", () => {
    const dark = (root.dataset.theme ?? (system.matches ? "dark" : "light")) === "dark";
    root.dataset.theme = dark ? "light" : "dark";
    changed();
  });
  system.addEventListener("change", changed);
}
