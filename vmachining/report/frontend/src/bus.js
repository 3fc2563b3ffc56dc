// One selection for the whole page: the table row that is marked, and how far the cut is played.

export class Bus {
  constructor(count) {
    this.count = count;
    this.row = -1;
    this.at = count; // rows that have cut; a fraction stands within a block
    this.listeners = [];
  }
  listen(what) { this.listeners.push(what); }
  tell(kind, source) { for (const listener of this.listeners) listener(kind, source); }
  select(row, source) {
    const next = Math.max(-1, Math.min(this.count - 1, row));
    if (next === this.row && source !== "again") return;
    this.row = next;
    this.tell("row", source);
  }
  play(at, source) {
    this.at = Math.max(0, Math.min(this.count, at));
    this.tell("at", source);
  }
}
