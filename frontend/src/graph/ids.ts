/** Random ids: 12 characters of A–Z, a–z and 0–9 (71 bits), never derived from a name. */

const LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789";
const LENGTH = 12;
// Bytes from here on would make the first letters likelier than the others.
const FAIR = 256 - (256 % LETTERS.length);

const AID = /^[A-Za-z0-9]{12}$/;

export function isAid(text: string): boolean {
  return AID.test(text);
}

/** A new id. Works without a secure context (plain http on a LAN), unlike `crypto.randomUUID`. */
export function newAid(): string {
  let id = "";
  while (id.length < LENGTH) {
    for (const byte of crypto.getRandomValues(new Uint8Array(LENGTH))) {
      if (byte < FAIR && id.length < LENGTH) id += LETTERS.charAt(byte % LETTERS.length);
    }
  }
  return id;
}
