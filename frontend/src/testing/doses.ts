/** A factor of the number that a test asks for: `make test` takes a fifth of it, `make soak` more than it. */
const SHARE = Number(process.env.TEST_EXAMPLES ?? 0.2);

/** Return on how many generated examples a property is tried that asks for `usual` of them. */
export const examples = (usual: number): number => Math.max(5, Math.round(usual * SHARE));
