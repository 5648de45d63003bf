/** A real OpenID Connect provider for browser tests: oidc-provider, with its own pages for development. */

import { createServer, type Server } from "node:http";
import type { AddressInfo } from "node:net";
// @ts-expect-error: it comes without types
import Provider from "oidc-provider";

const CLIENT = "action-assistant";
const SECRET = "the-secret-of-the-client";

/** A provider on a free port. Everybody is whom they call themselves there; `groups` says what they are in. */
export class IdentityProvider {
  readonly groups = new Map<string, string[]>();
  private readonly server: Server;
  private port = 0;

  constructor() {
    this.server = createServer();
  }

  get issuer(): string {
    return `http://localhost:${this.port}`;
  }

  /** The settings of a product whose people sign in here. */
  get settings(): Record<string, string> {
    return {
      ACTION_ASSISTANT_OIDC_ISSUER: this.issuer,
      ACTION_ASSISTANT_OIDC_CLIENT_ID: CLIENT,
      ACTION_ASSISTANT_OIDC_CLIENT_SECRET: SECRET,
      ACTION_ASSISTANT_OIDC_GROUPS: "admins=owner,lab=operator",
      ACTION_ASSISTANT_OIDC_NAME: "Lab login",
    };
  }

  async listen(): Promise<void> {
    await new Promise<void>((done) => this.server.listen(0, "localhost", done));
    this.port = (this.server.address() as AddressInfo).port;
  }

  /** Answer for a product at these addresses. */
  serve(pages: readonly string[]): void {
    const provider = new Provider(this.issuer, {
      clients: [
        {
          client_id: CLIENT,
          client_secret: SECRET,
          redirect_uris: pages.map((page) => `${page}/signed-in`),
        },
      ],
      claims: { openid: ["sub"], profile: ["name"], groups: ["groups"] },
      findAccount: (_: unknown, id: string) => ({
        accountId: id,
        claims: () => ({ sub: id, name: id, groups: this.groups.get(id) ?? [] }),
      }),
      pkce: { required: () => true },
      cookies: { keys: ["of this test"] },
    });
    this.server.on("request", provider.callback());
  }

  async close(): Promise<void> {
    this.server.closeAllConnections();
    await new Promise((done) => this.server.close(done));
  }
}
