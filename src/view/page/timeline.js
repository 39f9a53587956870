// Time: the slider with its eclipses, the clock and the buttons.

/** A time in words. */
export function words(seconds) {
  const whole = Math.round(seconds);
  const parts = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  return parts.map((part) => String(part).padStart(2, "0")).join(":");
}

/** Images that may have left the program before it heard of a wish. */
const UNDER_WAY = 2;

/** Time over which the rate is counted [ms], and the share of the chosen rate below which the page says so. */
const [COUNTED, KEPT] = [2000, 0.9];

/** The rate that stands for no bound [steps/s]. */
const UNBOUND = 240;

export class Timeline {
  constructor(send) {
    const by = (id) => document.getElementById(id);
    [this.slider, this.clock, this.playButton, this.marks, this.rate, this.reached, this.pace] =
      ["time", "clock", "play", "eclipses", "rate", "reached", "pace"].map(by);
    this.send = send;
    this.playing = false;
    this.held = false;
    /** Images that may still be from before the last wish. */
    this.stale = 0;
    this.steps = [];
    this.slider.addEventListener("input", () => {
      this.held = true;
      this.stale = UNDER_WAY;
      this.tell(this.slider.valueAsNumber);
      send({ do: "seek", time: this.slider.valueAsNumber * this.hello.step });
    });
    for (const name of ["change", "blur"]) {
      this.slider.addEventListener(name, () => {
        if (this.held) this.tell(Number(this.clock.dataset.step), this.slider.valueAsNumber);
        this.held = false;
      });
    }
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

  /** Tells a step, and the step to which time goes where that is another one. */
  tell(step, goal = step) {
    const time = step * this.hello.step;
    const shadow = this.shadow(time);
    const to = goal === step ? "" : `going to ${(goal * this.hello.step).toFixed(0)} s`;
    this.clock.textContent = [words(time), `${time.toFixed(0)} s`, to || shadow].filter(Boolean).join(" \u00b7 ");
    this.slider.setAttribute("aria-valuetext", [`${time.toFixed(0)} s`, shadow, to].filter(Boolean).join(", "));
  }

  /** Takes note of an image: whether the thumb follows it, and how fast time goes. */
  note(header) {
    if (this.stale > 0) this.stale = header.goal === this.slider.valueAsNumber ? 0 : this.stale - 1;
    const now = performance.now();
    if (!header.playing || header.goal > header.step + 1) this.steps = [];
    else this.steps = [...this.steps.filter(({ at }) => at > now - COUNTED), { at: now, step: header.step }];
  }

  /** Steps a second while time plays. `null` before they can be counted. */
  counted() {
    const [first, last] = [this.steps[0], this.steps.at(-1)];
    return first && last.at > first.at + COUNTED / 2 ? ((last.step - first.step) / (last.at - first.at)) * 1000 : null;
  }

  show(header) {
    this.playing = header.playing;
    this.clock.dataset.step = header.step;
    this.playButton.textContent = header.playing ? "\u23f8" : "\u25b6";
    this.playButton.setAttribute("aria-label", header.playing ? "Pause" : "Play");
    // The thumb stays where it was dropped. A line tells which step the image shows.
    this.reached.style.left = `${(100 * header.step) / this.hello.steps}%`;
    if (!this.held) {
      if (this.stale === 0) this.slider.value = header.goal;
      this.tell(header.step, this.slider.valueAsNumber);
    }
    const counted = this.counted();
    const slow = counted !== null && header.rate < UNBOUND && counted < KEPT * header.rate;
    const round = counted?.toFixed(counted < 10 ? 1 : 0);
    this.pace.textContent = slow ? `only ${round} of ${header.rate} steps/s: a step and its image take longer`
      : counted !== null && header.rate >= UNBOUND ? `${round} steps/s` : "";
    this.pace.classList.toggle("slow", slow);
  }
}
