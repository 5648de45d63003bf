/** Graphs to be built from nothing: what they shall mean, as files. */

const TIMER = { name: "TaTimer", type: "sync" };

/**
 * One timer that stops another when it has run out. The second counts without end, is not waited
 * for, and the graph ends when it has been stopped.
 */
export const semantics_test_5 = {
  graph_name: "semantics_test_5",
  graph_description: "tests the capability of on action being able to stop other actions",
  graph_entry: [
    { name: "TaTimer", instance_id: 0 },
    { name: "TaTimer", instance_id: 1 },
  ],
  graph_exit: [
    {
      name: "TaTimer",
      instance_id: 1,
      conditions: [
        "on_true -> ignore",
        "on_false -> ignore",
        "on_error -> ignore",
        "on_stopped -> run",
      ],
    },
  ],
  actions: [
    {
      ...TIMER,
      instance_id: 0,
      input_parameters: { count_until: { pvf_type: "number", pvf_value: 3.0 } },
      output_parameters: { final_count: { pvf_type: "number" } },
      children: [{ name: "TaTimer", instance_id: 1 }],
    },
    {
      ...TIMER,
      instance_id: 1,
      input_parameters: { count_until: { pvf_type: "number", pvf_value: 0.0 } },
      output_parameters: { final_count: { pvf_type: "number" } },
      parents: [
        {
          name: "TaTimer",
          instance_id: 0,
          required: false,
          conditions: [
            "on_true -> stop",
            "on_false -> bypass",
            "on_error -> bypass",
            "on_stopped -> ignore",
          ],
        },
      ],
    },
  ],
};

const only = (outcome: string, response = "run") =>
  ["on_true", "on_false", "on_error", "on_stopped"].map(
    (each) => `${each} -> ${each === outcome ? response : "ignore"}`,
  );

/** Look for a thing, fetch what was found under another name, and begin again; else tell somebody. */
export const fetching = {
  graph_name: "fetch_all",
  graph_entry: [{ name: "Look", instance_id: 0 }],
  graph_exit: [{ name: "Tell", instance_id: 0, conditions: only("on_true") }],
  actions: [
    {
      name: "Look",
      instance_id: 0,
      type: "sync",
      output_parameters: { found: { pvf_type: "string" } },
      parents: [{ name: "Fetch", instance_id: 0, required: false, conditions: only("on_true") }],
      children: [
        { name: "Fetch", instance_id: 0, remap: [{ from: "found", to: "thing" }] },
        { name: "Tell", instance_id: 0 },
      ],
    },
    {
      name: "Fetch",
      instance_id: 0,
      type: "sync",
      input_parameters: { thing: { pvf_type: "string" } },
      parents: [{ name: "Look", instance_id: 0, required: true, conditions: only("on_true") }],
      children: [{ name: "Look", instance_id: 0 }],
    },
    {
      name: "Tell",
      instance_id: 0,
      type: "sync",
      input_parameters: { text: { pvf_type: "string", pvf_value: "nothing left" } },
      parents: [{ name: "Look", instance_id: 0, required: true, conditions: only("on_false") }],
    },
  ],
};
