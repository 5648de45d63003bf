/** Says at the very end what failed and why, in few lines, also what passed when it was tried again, and
 * what was skipped: logs are read from their end. */

import { stripVTControlCharacters } from "node:util";
import type { FullResult, Reporter, TestCase, TestResult } from "@playwright/test/reporter";

const LINES = 6;
/** How reasons begin for which CI may skip a test; any other skip fails it. */
const ACCEPTED = [
  "takes long:", // `make soak ARGS=browser` runs them
  "has its turn on another day:", // every third; `make soak` runs all
  "takes pictures for the documentation:", // `make pictures`
  "takes pictures to be looked at:", // `make screens`
  "measures;", // `make performance`
  "in other browsers than CI has:", // `make browsers`
  "needs running containers:", // `make containers`
];

export default class Failures implements Reporter {
  private readonly said: string[] = [];
  private readonly skipped = new Map<string, number>();

  onTestEnd(test: TestCase, result: TestResult): void {
    if (result.status === "skipped") this.count([...test.annotations, ...result.annotations]);
    if (result.status === test.expectedStatus || result.status === "skipped") return;
    const where = `${test.location.file.split("/").at(-1)}:${test.location.line}`;
    const again = result.retry < test.retries ? ", and was tried again" : "";
    this.said.push(`✘ ${where} ${test.title} (${result.status}${again})`);
    for (const { message = "", location } of result.errors) {
      const lines = stripVTControlCharacters(message).split("\n").filter(Boolean).slice(0, LINES);
      this.said.push(...lines.map((line) => `    ${line}`), `    at line ${location?.line ?? "?"}`);
    }
  }

  /** A test without a reason was not reached, because another one failed. */
  private count(annotations: TestCase["annotations"]): void {
    const reason = annotations.find(({ type }) => type === "skip")?.description;
    if (reason) this.skipped.set(reason, (this.skipped.get(reason) ?? 0) + 1);
  }

  async onEnd({ status }: FullResult): Promise<Pick<FullResult, "status">> {
    const wrong = [...this.skipped.keys()].filter(
      (reason) => process.env.CI && !ACCEPTED.some((start) => reason.startsWith(start)),
    );
    const number = [...this.skipped.values()].reduce((sum, count) => sum + count, 0);
    if (number > 0) {
      const reasons = [...this.skipped].sort(([, a], [, b]) => b - a);
      const each = reasons.map(([reason, count]) => `${count} × ${reason}`).join("; ");
      this.said.push(`${number === 1 ? "1 test was" : `${number} tests were`} skipped: ${each}`);
    }
    this.said.push(
      ...wrong.map((reason) => `✘ CI may not skip this (e2e/failure-reporter.ts): ${reason}`),
    );
    for (const line of this.said) process.stderr.write(`${line}\n`);
    return { status: wrong.length > 0 && status === "passed" ? "failed" : status };
  }
}
