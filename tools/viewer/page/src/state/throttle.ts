// Keeps requests to one outstanding. Of the requests that wait, only the newest is kept.

export class Throttle<T> {
  private outstanding: number | null = null;
  private waiting: T | undefined;

  /** @param send  Sends one request, and returns its id; null if it could not be sent. */
  constructor(private readonly send: (request: T) => number | null) {}

  ask(request: T): void {
    if (this.outstanding === null) {
      this.outstanding = this.send(request);
    } else {
      this.waiting = request;
    }
  }

  /** The answer to request `id` is there. */
  answered(id: number): void {
    if (this.outstanding === null || id < this.outstanding) return;
    this.outstanding = null;
    const next = this.waiting;
    this.waiting = undefined;
    if (next !== undefined) this.ask(next);
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
