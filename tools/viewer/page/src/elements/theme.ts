// Light and dark. Without a choice of the user, the system decides.

const key = "tensorray-theme";
const themes = ["system", "light", "dark"] as const;
const marks = { system: "◐", light: "☀", dark: "☾" };

export class Theme {
  private current: (typeof themes)[number] = "system";
  private listeners: (() => void)[] = [];

  constructor(private readonly switch_button: HTMLButtonElement) {
    const stored = localStorage.getItem(key);
    this.choose(themes.find((theme) => theme === stored) ?? "system");
    switch_button.addEventListener("click", () => {
      const next = themes[(themes.indexOf(this.current) + 1) % themes.length]!;
      localStorage.setItem(key, next);
      this.choose(next);
    });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.notify());
  }

  on_change(listener: () => void): void {
    this.listeners.push(listener);
  }

  private choose(theme: (typeof themes)[number]): void {
    this.current = theme;
    if (theme === "system") delete document.documentElement.dataset["theme"];
    else document.documentElement.dataset["theme"] = theme;
    this.switch_button.textContent = marks[theme];
    const name = { system: "as the system", light: "light", dark: "dark" }[theme];
    this.switch_button.title = "Theme: " + name;
    this.switch_button.setAttribute("aria-label", "Theme: " + name);
    this.notify();
  }

  private notify(): void {
    for (const listener of this.listeners) listener();
  }
}
