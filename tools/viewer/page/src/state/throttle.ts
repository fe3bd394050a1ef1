// Keeps requests to one outstanding, and apart in time. Of the requests that wait, only the newest is kept.

export class Throttle<T> {
  private outstanding: number | null = null;
  private waiting: T | undefined;
  private last = 0;
  private timer = 0;

  /**
   * @param send  Sends one request, and returns its id; null if it could not be sent.
   * @param interval  Between requests; ms.
   */
  constructor(private readonly send: (request: T) => number | null, private readonly interval = 0) {}

  ask(request: T): void {
    this.waiting = request;
    this.next();
  }

  /** The answer to request `id` is there. */
  answered(id: number): void {
    if (this.outstanding === null || id < this.outstanding) return;
    this.outstanding = null;
    this.next();
  }

  private next(): void {
    const request = this.waiting;
    if (this.outstanding !== null || request === undefined) return;
    clearTimeout(this.timer);
    const wait = this.last + this.interval - Date.now();
    if (wait > 0) {
      this.timer = window.setTimeout(() => this.next(), wait);
      return;
    }
    this.last = Date.now();
    this.waiting = undefined;
    this.outstanding = this.send(request);
  }

  is_outstanding(id: number): boolean {
    return this.outstanding === id;
  }

  /** Forgets everything: the connection was lost. */
  reset(): void {
    this.outstanding = null;
    this.waiting = undefined;
  }
}
