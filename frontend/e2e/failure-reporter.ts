/** Says at the very end what failed and why, in few lines, also what passed when it was tried again:
 * logs are read from their end. */

import { stripVTControlCharacters } from "node:util";
import type { Reporter, TestCase, TestResult } from "@playwright/test/reporter";

const LINES = 6;

export default class Failures implements Reporter {
  private readonly said: string[] = [];

  onTestEnd(test: TestCase, result: TestResult): void {
    if (result.status === test.expectedStatus || result.status === "skipped") return;
    const where = `${test.location.file.split("/").at(-1)}:${test.location.line}`;
    const again = result.retry < test.retries ? ", and was tried again" : "";
    this.said.push(`✘ ${where} ${test.title} (${result.status}${again})`);
    for (const { message = "", location } of result.errors) {
      const lines = stripVTControlCharacters(message).split("\n").filter(Boolean).slice(0, LINES);
      this.said.push(...lines.map((line) => `    ${line}`), `    at line ${location?.line ?? "?"}`);
    }
  }

  onEnd(): void {
    for (const line of this.said) process.stderr.write(`${line}\n`);
  }
}
