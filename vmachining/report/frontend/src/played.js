// A cut that is played: states along the path are kept, so that a slider goes back without cutting from the start again.

export class Played {
  // states : names of the typed arrays that change. marks : how many states are kept.
  constructor(path, states, marks) {
    this.path = path;
    this.states = states;
    this.done = 0; // segments that have cut
    this.all = true; // the whole picture is to be drawn, not only `changed`
    this.changed = []; // places that were cut since it was drawn
    this.marks = [];
    this.every = Math.max(1, Math.ceil(path.count / marks));
  }
  keep() { this.marks.push({ done: this.done, ...Object.fromEntries(this.states.map((name) => [name, this[name].slice()])) }); }
  take(mark) {
    for (const name of this.states) this[name].set(mark[name]);
    this.done = mark.done;
    this.all = true;
    this.changed.length = 0;
  }

  // Bring the picture to the state after `segments` of the path, and `share` of the next one.
  to(segments, share) {
    if (this.place?.[0] === segments && this.place[1] === share) return;
    this.place = [segments, share];
    const back = segments < this.done || this.partial;
    let best = null;
    if (back || segments > this.done + this.every) {
      for (const mark of this.marks) if (mark.done <= segments && (back || mark.done > this.done) && mark.done >= (best?.done ?? 0)) best = mark;
    }
    if (best) this.take(best);
    this.partial = false;
    while (this.done < segments) {
      this.cut(this.done, 1);
      this.done += 1;
      if (this.done % this.every === 0 && !this.marks.some((mark) => mark.done === this.done)) this.keep();
    }
    if (share > 0 && segments < this.path.count) { this.cut(segments, share); this.partial = true; }
  }
}
