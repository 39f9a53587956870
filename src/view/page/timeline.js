// Time: the slider with its eclipses, the clock and the buttons.

/** A time in words. */
export function words(seconds) {
  const whole = Math.round(seconds);
  const parts = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  return parts.map((part) => String(part).padStart(2, "0")).join(":");
}

export class Timeline {
  constructor(send) {
    const by = (id) => document.getElementById(id);
    [this.slider, this.clock, this.playButton, this.marks, this.rate] = ["time", "clock", "play", "eclipses", "rate"].map(by);
    this.send = send;
    this.playing = false;
    this.held = false;
    this.slider.addEventListener("input", () => {
      this.held = true;
      this.tell(this.slider.valueAsNumber);
      send({ do: "seek", time: this.slider.valueAsNumber * this.hello.step });
    });
    for (const name of ["change", "blur"]) this.slider.addEventListener(name, () => { this.held = false; });
    this.playButton.addEventListener("click", () => this.toggle());
    by("back").addEventListener("click", () => send({ do: "step", by: -1 }));
    by("on").addEventListener("click", () => send({ do: "step", by: 1 }));
    this.rate.addEventListener("change", () => { if (this.playing) this.play(); });
  }

  play() {
    this.send({ do: "play", rate: Number(this.rate.value) });
  }

  toggle() {
    if (this.playing) this.send({ do: "pause" });
    else this.play();
  }

  take(hello) {
    this.hello = hello;
    this.slider.max = hello.steps;
    const end = hello.steps * hello.step;
    this.marks.replaceChildren();
    for (const name of ["penumbra", "umbra"]) {
      for (const [from, to] of hello[name]) {
        const mark = document.createElement("div");
        mark.className = name;
        mark.style.left = `${(100 * from) / end}%`;
        mark.style.width = `${Math.max((100 * (to - from)) / end, 0.2)}%`;
        this.marks.append(mark);
      }
    }
  }

  shadow(time) {
    const within = (name) => this.hello[name].some(([from, to]) => time >= from && time < to);
    return within("umbra") ? "eclipse" : within("penumbra") ? "part of the Sun" : "";
  }

  tell(step) {
    const time = step * this.hello.step;
    const shadow = this.shadow(time);
    this.clock.textContent = [words(time), `${time.toFixed(0)} s`, shadow].filter(Boolean).join(" \u00b7 ");
    this.slider.setAttribute("aria-valuetext", `${time.toFixed(0)} s${shadow ? `, ${shadow}` : ""}`);
  }

  show(header) {
    this.playing = header.playing;
    this.clock.dataset.step = header.step;
    this.playButton.textContent = header.playing ? "\u23f8" : "\u25b6";
    this.playButton.setAttribute("aria-label", header.playing ? "Pause" : "Play");
    if (!this.held) {
      this.slider.value = header.step;
      this.tell(header.step);
    }
  }
}
