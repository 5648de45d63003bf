/** What the runner takes and answers. Made by `make types`; changes are lost. */
export interface RunnerApi {
    /**
     * ActionChange
     * @description An action that was added, removed or changed. `name`: its full name after the change, or
     *     before it if the action was removed.
     */
    ActionChange: {
        /** @enum {string} */
        change: "added" | "changed" | "removed";
        aid: string;
        name: string;
        fields: RunnerApi["Field"][];
    };
    /**
     * ActionFrame
     * @description The change of an action. `state`: its new state, as the engine names it. Its visits from number
     *     `first` on (counted from 0, over all its visits) are now `visits`; `messages` are new. `aid`: its
     *     key in the document, null if unknown.
     */
    ActionFrame: {
        state: string;
        first: number;
        /** @default [] */
        visits?: RunnerApi["VisitShown"][];
        /** @default [] */
        messages?: RunnerApi["MessageShown"][];
        aid?: string;
    };
    /**
     * ActionShown
     * @description One action of a run. It ran `count` times; with `at_least` perhaps more often, since visits
     *     may have been missed. `visits` are the newest ones; `older`: how many are not listed. `robot`:
     *     the engine that plays it in a led run; `piece`: the id of the run of its newest piece;
     *     `asks`: it has ended without an outcome, which a person has to give; `levels`: the opened sub-graphs
     *     that it is inside of, the outermost first.
     */
    ActionShown: {
        aid: string | null;
        state: string;
        visits: RunnerApi["VisitShown"][];
        older: number;
        messages: RunnerApi["MessageShown"][];
        /** @default 0 */
        count?: number;
        /** @default false */
        at_least?: boolean;
        /** @default  */
        robot?: string;
        /** @default  */
        piece?: string;
        /** @default false */
        asks?: boolean;
        /** @default [] */
        levels?: string[];
    };
    /**
     * ActionStatistics
     * @description One action over all these runs. `levels`: the actions around it, outermost first; `name`: its
     *     own; `action`: the name that the engine of its newest run used. Durations: seconds over the
     *     `timed` ended visits, null if not known exactly; `spans`: bounds of all. `unknown`: visits of
     *     unknown result; `said`: results that persons gave by word, which are in no other count. `at_least`: there may have been more `visits`, which nobody saw.
     */
    ActionStatistics: {
        action: string;
        levels: string[];
        name: string;
        aid: string | null;
        runs: number;
        visits: number;
        at_least: boolean;
        results: {
            [key: string]: number;
        };
        said: {
            [key: string]: number;
        };
        unknown: number;
        inferred: number;
        timed: number;
        p50: number | null;
        p90: number | null;
        p99: number | null;
        longest: number | null;
        spans: RunnerApi["Spans"];
    };
    /**
     * Activity
     * @description The activity of a process: open sockets, rooms of an editor, runs and robots of a runner.
     */
    Activity: {
        sockets: number;
        rooms: number | null;
        runs: number | null;
        stops_unconfirmed: number | null;
        robots: RunnerApi["RobotLink"][];
    };
    /**
     * Adopted
     * @description The record of a token that the editor made. It is no secret, and its seal proves it.
     */
    Adopted: {
        record: RunnerApi["TokenRecord"];
    };
    /**
     * AlarmShown
     * @description A message that a person must see now.
     */
    AlarmShown: {
        code: string;
        /** Format: date-time */
        at: string;
        text: string;
    };
    /**
     * AnswerRequest
     * @description The answer to a question. `value`: true or false for a confirmation, the text of a choice, a text,
     *     a number, or the id of a photo that was sent for this question. `cannot`: why there is no answer,
     *     in place of it. `request_id`: names this press; a repeat of one that has counted changes nothing.
     *     `watching`: as in `StartRequest`, for the robots that may move next.
     */
    AnswerRequest: {
        /** @default null */
        value?: boolean | number | string | null;
        /** @default  */
        cannot?: string;
        /** @default  */
        request_id?: string;
        /** @default {} */
        watching?: {
            [key: string]: boolean;
        };
    };
    /**
     * AnswerShown
     * @description The answer of a person to the question of a visit. `value`: null if they could not answer, for a
     *     `reason`; of a photo its id.
     */
    AnswerShown: {
        question: string;
        by: RunnerApi["Author"];
        /** Format: date-time */
        at: string;
        value?: boolean | number | string;
        /** @default  */
        reason?: string;
    };
    /**
     * Approval
     * @description A person's yes to exactly the graph with this digest.
     */
    Approval: {
        digest: string;
        author: RunnerApi["Author"];
        /** Format: date-time */
        at: string;
        graph: string | null;
        version: string;
        note: string;
    };
    /**
     * ApprovalQuestion
     * @description The body of a request that asks others for an approval. `robots`, `values`: those of the start.
     */
    ApprovalQuestion: {
        digest: string;
        robots: string[];
        graph_name: string;
        /** @default null */
        graph?: string | null;
        /** @default  */
        version?: string;
        /** @default {} */
        values?: {
            [key: string]: {
                [key: string]: boolean | number | string | (boolean | number | string)[];
            };
        };
    };
    /**
     * ApprovalRequest
     * @description The body of an approval of exactly one graph.
     */
    ApprovalRequest: {
        digest: string;
        /** @default null */
        graph?: string | null;
        /** @default  */
        version?: string;
        /** @default  */
        note?: string;
    };
    /**
     * ApprovalWanted
     * @description A person's question for the yes of others to a start: `digest` is that of its whole order, and
     *     `order` says all of it in words, by a look of the runner (nothing where that is not known);
     *     `values` are those that it gives the graph, `tree_digest` is that of its version, "" if not known.
     *     `hidden`: why the reader sees no more than who asks and for which robots, "" if they see all of it.
     */
    ApprovalWanted: {
        digest: string;
        author: RunnerApi["Author"];
        /** Format: date-time */
        at: string;
        robots: string[];
        version: string;
        values: {
            [key: string]: {
                [key: string]: boolean | number | string | (boolean | number | string)[];
            };
        };
        order: RunnerApi["OrderLine"][];
        tree_digest: string;
        hidden: string;
    };
    /**
     * ArchiveRequest
     * @description A request to archive runs and raw messages that ended more than so many days ago; null
     *     archives none.
     */
    ArchiveRequest: {
        /** @default null */
        runs?: number | null;
        /** @default null */
        raw?: number | null;
    };
    /**
     * ArchivedShown
     * @description The time at which the events of a run were moved to an archive, and its file in the folder of
     *     archives.
     */
    ArchivedShown: {
        /** Format: date-time */
        at: string;
        file: string;
    };
    /**
     * ArrowCoverage
     * @description The coverage of a graph by some courses together, as numbers of arrows and of actions.
     *
     *     `taken` of `arrows` arrows were taken, `visited` of `actions` actions have run. `untaken` and
     *     `unvisited` list the others in file order, at most `SHOWN` of each.
     */
    ArrowCoverage: {
        arrows: number;
        taken: number;
        actions: number;
        visited: number;
        untaken: RunnerApi["OutcomeArrow"][];
        unvisited: string[];
    };
    /**
     * ArrowProposal
     * @description The result of a search for an arrow. `verdict`: `reached` (with a `script`), `unreachable`
     *     (after all `states`) or `undecided` (with `why`).
     */
    ArrowProposal: {
        verdict: string;
        script: {
            [key: string]: unknown;
        } | null;
        states: number;
        why: string;
    };
    /**
     * AskedInput
     * @description An input for which a start asks. `action`, `name`: its full and flat name; `aid`: the key of the
     *     action; `open`: the graph has no value for it and cannot run without; `value`: the one that it has
     *     otherwise; `allowed`: the values that it can have, if not all; `least`, `most`: the bounds that its
     *     author set.
     */
    AskedInput: {
        action: string;
        name: string;
        aid: string;
        type: string;
        open: boolean;
        value?: boolean | number | string | (boolean | number | string)[];
        example?: boolean | number | string | (boolean | number | string)[];
        /** @default [] */
        allowed?: (boolean | number | string | (boolean | number | string)[])[];
        least?: number;
        most?: number;
        /** @default  */
        description?: string;
        /** @default  */
        unit?: string;
    };
    /**
     * AskedInputsRequest
     * @description A graph, of which the inputs are wanted for which a start asks. `from`: where that begins, if not
     *     at the entry; `graph`: the id of the graph, if it takes values of an earlier run.
     */
    AskedInputsRequest: {
        /** @description The UMRF graph itself, as approved, or a string that holds its JSON text */
        umrf: {
            [key: string]: unknown;
        } | string;
        /** @default null */
        graph?: string | null;
        /** @default null */
        from?: RunnerApi["StartFrom"] | null;
    };
    /**
     * AskedOthers
     * @description The number of receivers to which the question is sent.
     */
    AskedOthers: {
        receivers: number;
    };
    /**
     * AssumedShown
     * @description An action that counts as ended. `outcome`: of the earlier run, null if no run shows one, and `at`
     *     when it came; `by`: the person who stated it, "" if it was seen.
     */
    AssumedShown: {
        action: string;
        outcome: ("error" | "false" | "stopped" | "true") | null;
        at: string | null;
        by: string;
    };
    /**
     * AtRestShown
     * @description The observation that a run is at rest, where no answer of the engine could prove it: by whom
     *     (null: the runner saw the engine's process end), when, and how.
     */
    AtRestShown: {
        by: RunnerApi["Author"] | null;
        /** Format: date-time */
        at: string;
        how: string;
    };
    /**
     * AuditPage
     * @description Rows, the newest first. `before`: the cursor of the next page; null once the begin of the log is
     *     reached. A page may be empty and have a cursor, since one answer looks at a part of the log.
     *     `back_to`: the time of the oldest event that was looked at; `dropped`: the newest rows that were
     *     dropped because of their age; null if none were.
     */
    AuditPage: {
        rows: RunnerApi["AuditRow"][];
        before: number | null;
        back_to: string | null;
        dropped: RunnerApi["DroppedRows"] | null;
    };
    /**
     * AuditRow
     * @description One fact of the audit. `id`: `editor` or `runner`, and the position in its log. `person`: none
     *     for strangers. `from`: the connection of the person; none where it was not recorded. `times`: how
     *     often it happened, where repetitions have one row.
     */
    AuditRow: {
        id: string;
        position: number;
        /** Format: date-time */
        at: string;
        /** @enum {string} */
        kind: "edits" | "graphs" | "other" | "people" | "refused" | "robots" | "sessions" | "starts" | "stops" | "strangers";
        event: string;
        text: string;
        /** @default null */
        person?: RunnerApi["PersonRef"] | null;
        /** @default null */
        from?: RunnerApi["Origin"] | null;
        /** @default  */
        graph?: string;
        /** @default  */
        graph_name?: string;
        /** @default null */
        seq?: number | null;
        /** @default  */
        run?: string;
        /** @default null */
        run_number?: number | null;
        /** @default [] */
        robots?: string[];
        /** @default 1 */
        times?: number;
    };
    /**
     * Author
     * @description The person behind a command, and the origin of the command. `address`: on the network; "" for
     *     the runner's own computer. `by`: "" if it was not recorded. `program`: the name of the token by
     *     which a program acted for the person; "" if there is none.
     */
    Author: {
        id: string;
        name: string;
        /**
         * @default
         * @enum {string}
         */
        by?: "" | "browser" | "program";
        /** @default  */
        address?: string;
        /** @default  */
        program?: string;
    };
    /**
     * Axis
     * @description An input of a grid, by the full name of its action and its flat name, with the values that it gets
     *     in turn.
     */
    Axis: {
        action: string;
        name: string;
        values: (boolean | number | string | (boolean | number | string)[])[];
    };
    /**
     * BackupsShown
     * @description The last backup and what it lacks, the failure since then, the last restore rehearsal, and
     *     when the next backup is due. Fields are null where there was none.
     */
    BackupsShown: {
        made_at: string | null;
        bytes: number | null;
        seconds: number | null;
        missing: string[];
        off_site: string | null;
        failed_at: string | null;
        failed_why: string | null;
        proven_at: string | null;
        unsound: string | null;
        next_at: string | null;
        keep: string | null;
        is_late: boolean;
    };
    /**
     * BatonHand
     * @description Hands a baton, or a run with all batons of its robots, to a person who has a page open.
     */
    BatonHand: {
        to: string;
    };
    /**
     * BatonTake
     * @description Takes a baton. `reason`: why it is taken over from its holder.
     */
    BatonTake: {
        /** @default  */
        reason?: string;
    };
    /**
     * Behaviour
     * @description The behaviour of one call of an action. Times are seconds.
     *
     *     `after_s`: how long it runs. `result`: how it ends. `stop_s`: how long a stop takes. `never`: it
     *     does not end by itself. `ignores_stop`: it continues until its own end; 5 s after a stop the engine
     *     calls it ERROR. `stop_error`: it throws in onStop; the engine shows ERROR at once, whatever its code
     *     does. `pauses`: it has an onPause. `load_s`: how long it loads (library and `onInit`) when it is
     *     triggered for the first time, which the engine does not count as running. `init_error`: it throws
     *     when it is loaded. `no_library`: it is indexed and its library is missing, so that no graph with it
     *     can be built (read from its first call). `outputs`: values by flat name; others get the value of the
     *     file, else their first allowed value, else the neutral one of their type. `message`: a line of its
     *     log.
     */
    Behaviour: {
        /** @default 1 */
        after_s?: number;
        /**
         * @default on_true
         * @enum {string}
         */
        result?: "on_true" | "on_false" | "on_error";
        /** @default 0.05 */
        stop_s?: number;
        /** @default 0 */
        load_s?: number;
        /** @default true */
        pauses?: boolean;
        /** @default false */
        never?: boolean;
        /** @default false */
        ignores_stop?: boolean;
        /** @default false */
        stop_error?: boolean;
        /** @default false */
        init_error?: boolean;
        /** @default false */
        no_library?: boolean;
        /** @default null */
        outputs?: Record<string, unknown> | null;
        /** @default null */
        message?: string | null;
    };
    /**
     * BehaviourList
     * @description The behaviours in a folder. `names`: in snake case, as the files without `.py`; `refused`:
     *     those that cannot be run, with the reason; `problem`: why the folder cannot be read, "" if it
     *     can.
     */
    BehaviourList: {
        names: string[];
        refused: {
            [key: string]: string;
        };
        problem: string;
    };
    /**
     * Breakpoint
     * @description Lets a led run wait before the action with the full name `action` begins; after it has ended, if
     *     it has `outcomes`; or when it has ended and the arrow to the action `to` ("exit": the end of the
     *     graph) lets that go on. `visit`: only at this visit of `action`, from 1; 0 for each. `value`: only
     *     if an input meets this, or, after its end, an output. `inside`: the name of the sub-graph in which
     *     both actions stand: it counts wherever the start of the run opens that; "" for the graph itself.
     */
    Breakpoint: {
        action: string;
        /** @default  */
        to?: string;
        /** @default 0 */
        visit?: number;
        /** @default [] */
        outcomes?: ("error" | "false" | "true")[];
        /** @default null */
        value?: RunnerApi["ValueTest"] | null;
        /** @default  */
        inside?: string;
    };
    /**
     * BreakpointsRequest
     * @description Sets the breakpoints of a led run. `was`: those that the person saw; if there are others now, it
     *     is refused. `watching`: as in `StartRequest`, if one of them is taken away.
     */
    BreakpointsRequest: {
        breakpoints: RunnerApi["Breakpoint"][];
        was: RunnerApi["Breakpoint"][];
        /** @default {} */
        watching?: {
            [key: string]: boolean;
        };
    };
    /**
     * Candidate
     * @description An engine that discovery shows. `actor`: its name, "" until its feedback was received, since
     *     an engine without a running graph does not send its name; a person has to know it then.
     */
    Candidate: {
        domain: number;
        rmw: string;
        get_service: string;
        servers: number;
        actor: string;
        /** @enum {string} */
        generation: "current" | "older" | "unknown";
        problem: string;
    };
    /**
     * CauseShown
     * @description One cause in a sentence, with its evidence: the time, the event `seq` by which it was seen,
     *     the action, a quoted text, and the person at this runner who caused it (`author`). The sentence
     *     begins with the name that the person had then, or with *Somebody*.
     */
    CauseShown: {
        kind: string;
        text: string;
        /** Format: date-time */
        at: string;
        seq: number;
        action: string | null;
        aid: string | null;
        quote: string;
        author: RunnerApi["Author"] | null;
    };
    /**
     * Cell
     * @description A cell of a repeat, with its run; null until it is started.
     */
    Cell: {
        cell: number;
        values: {
            [key: string]: {
                [key: string]: boolean | number | string | (boolean | number | string)[];
            };
        };
        run: RunnerApi["Listed"] | null;
    };
    /**
     * CellLookRequest
     * @description Asks for the pre-flight of the next cell of a repeat as it is now. `watching`: as in
     *     `StartRequest`.
     */
    CellLookRequest: {
        /** @default {} */
        watching?: {
            [key: string]: boolean;
        };
    };
    /**
     * CheckRequest
     * @description A request to check the expected courses of `graph` against the text `umrf`. `subgraphs`: the
     *     graphs inside; if empty, those stored with each expectation are used.
     */
    CheckRequest: {
        /** @description The UMRF graph itself, as approved, or a string that holds its JSON text */
        umrf: {
            [key: string]: unknown;
        } | string;
        graph: string;
        /** @default [] */
        subgraphs?: RunnerApi["SentSubgraph"][];
    };
    /**
     * CheckedCourse
     * @description One checked expected course. `same`: null if there was no time to check it; `why`: where the
     *     courses differ. `run`: "" for the course of a dry-run.
     */
    CheckedCourse: {
        name: string;
        run: string;
        author: RunnerApi["Author"];
        at: number;
        same: boolean | null;
        why: string;
        taken: RunnerApi["OutcomeArrow"][];
        script: {
            [key: string]: unknown;
        };
    };
    /**
     * CheckedCourses
     * @description All expected courses of a graph, by name, and the coverage by those that still go the same
     *     way.
     */
    CheckedCourses: {
        courses: RunnerApi["CheckedCourse"][];
        coverage: RunnerApi["ArrowCoverage"];
    };
    /**
     * ClosedQuestion
     * @description A question that is not open any more. `by`: who has answered it, and `value` how; `why`: the reason
     *     if nobody has: it was asked again since 60 s had passed ("lapsed") or the run waited ("held"), its
     *     deadline passed, the runner was restarted, or it was stopped.
     */
    ClosedQuestion: {
        question: string;
        action: string;
        /** Format: date-time */
        at: string;
        by?: RunnerApi["Author"];
        value?: boolean | number | string;
        why?: "deadline" | "held" | "lapsed" | "restarted" | "stopped";
    };
    /**
     * ClosedShown
     * @description The reason why a repeat is closed, in words; `by`: the person who caused it, `run`: the run that did.
     */
    ClosedShown: {
        /** @enum {string} */
        why: "baton" | "complete" | "looked" | "lost" | "moves" | "person" | "refused" | "restart" | "run" | "stop";
        text: string;
        /** Format: date-time */
        at: string;
        by: RunnerApi["Author"] | null;
        run: string | null;
    };
    /**
     * ComparedVisit
     * @description The visit number `visit` (from 1) of an action in both runs; null where a run lacks it.
     *     `levels`: the actions around it, outermost first; `name`: its own; `action`: the name that
     *     its engine used. `slower`: the run in which it certainly took notably longer.
     */
    ComparedVisit: {
        action: string;
        levels: string[];
        name: string;
        aid: string | null;
        visit: number;
        a: RunnerApi["VisitShown"] | null;
        b: RunnerApi["VisitShown"] | null;
        /** @enum {string} */
        relation: "end" | "only_a" | "only_b" | "result" | "same" | "unknown";
        slower: ("a" | "b") | null;
    };
    /**
     * ConfirmMessage
     * @description All requests to confirm who somebody is that this page can answer now.
     */
    ConfirmMessage: {
        /** @enum {string} */
        type: "confirm";
        asked: RunnerApi["ConfirmationShown"][];
    };
    /**
     * Confirmation
     * @description The last confirmation of a session. `at`: seconds since 1970. `seal`: proves that a server
     *     with the same token made it, so it may be shown to anybody.
     */
    Confirmation: {
        session: string;
        at: number;
        /** @enum {string} */
        how: "command" | "device" | "oidc" | "passkey";
        seal: string;
    };
    /**
     * ConfirmationAnswer
     * @description The answer of the person on another device: whether it is they who ask.
     */
    ConfirmationAnswer: {
        yes: boolean;
    };
    /**
     * ConfirmationAsked
     * @description A request, for the device that made it. `devices`: how many other devices of the person show it
     *     now; `seconds`: until it is over; `record`: the sealed confirmation, once another device has said
     *     yes.
     */
    ConfirmationAsked: {
        id: string;
        number: string;
        seconds: number;
        /** @enum {string} */
        state: "confirmed" | "refused" | "waiting";
        devices: number;
        record: RunnerApi["Confirmation"] | null;
    };
    /**
     * ConfirmationShown
     * @description A request, as other devices of its person show it. `browser` and `address`: of the device that
     *     asks, "" for the computer of the server; `robots`: on which it wants to start; `seconds`: until it
     *     is over.
     */
    ConfirmationShown: {
        id: string;
        number: string;
        browser: string;
        address: string;
        robots: string[];
        seconds: number;
    };
    /**
     * ConfirmationWanted
     * @description A wish to be confirmed. `robots`: on which the person wants to start; empty for other things.
     */
    ConfirmationWanted: {
        /** @default [] */
        robots?: string[];
    };
    /**
     * CoursePart
     * @description A part of the time of a run, in sixtieths of it. `shows`: the result of the visits in it, the
     *     worst one where there are several; "done": they ended with a result that nobody saw, or that is
     *     not listed any more; "unknown": no end was seen; "none": no action was seen running.
     */
    CoursePart: {
        shows: ("error" | "false" | "stopped" | "true") | ("done" | "none" | "unknown");
        steps: number;
    };
    /**
     * Difference
     * @description The difference between two states of one graph. `before` and `after` are the numbers of the
     *     document's changes at which the graph was in these states.
     */
    Difference: {
        before: number;
        after: number;
        fields: RunnerApi["Field"][];
        actions: RunnerApi["ActionChange"][];
        relations: RunnerApi["RelationChange"][];
        notes: RunnerApi["NoteChange"][];
    };
    /**
     * Doubt
     * @description A fact that the run does not show, so that the script had to guess it.
     */
    Doubt: {
        action: string;
        text: string;
    };
    /**
     * DrillRequest
     * @description Records a Stop drill with a run on the robot. `saw_it_stop`: the person saw the robot stop;
     *     `hardware_stop`: they tried its hardware stop.
     */
    DrillRequest: {
        run: string;
        saw_it_stop: boolean;
        hardware_stop: boolean;
    };
    /**
     * DrillShown
     * @description A Stop drill: with which run, by whom, when Stop was pressed, and the milliseconds until rest was
     *     proven; null if it was not. `failure`: why it failed, "" if it passed.
     */
    DrillShown: {
        run: string;
        number: number;
        by: RunnerApi["PersonRef"];
        /** Format: date-time */
        stopped_at: string;
        proof_ms: number | null;
        saw_it_stop: boolean;
        hardware_stop: boolean;
        failure: string;
    };
    /**
     * DroppedRows
     * @description Rows up to `until` that only the audit had were dropped `at` this time, since they were older
     *     than `days`.
     */
    DroppedRows: {
        /** Format: date-time */
        until: string;
        /** Format: date-time */
        at: string;
        days: number;
    };
    /**
     * DurationBounds
     * @description A duration in seconds, between `least` and `most`; `most` is null without an upper bound.
     */
    DurationBounds: {
        least: number;
        most: number | null;
    };
    /**
     * EarlierShown
     * @description The outcomes and values that a run takes for granted. `number`: of the earlier run, 0 for none; `begins`: the actions
     *     with which it begins; `assumed`, `values`: outcomes and values of before; `skipped`: what it does not
     *     play; `ended_by`: what only a skipped action would stop; `under_way`: the actions that had begun and
     *     had no outcome, for each of which a person chooses (`choices`, with the reason of their word).
     */
    EarlierShown: {
        number: number;
        begins: string[];
        assumed: RunnerApi["AssumedShown"][];
        values: RunnerApi["TakenValueShown"][];
        skipped: string[];
        ended_by: RunnerApi["EndedBy"][];
        under_way: RunnerApi["UnderWay"][];
        choices: {
            [key: string]: "again" | "error" | "false" | "leave" | "true";
        };
        reason: string;
    };
    /**
     * EndedBy
     * @description An action that an arrow of another one would stop, which is left out. Both by full name.
     */
    EndedBy: {
        action: string;
        by: string;
    };
    /**
     * EnginesMessage
     * @description All engines, sent when one of them has changed.
     */
    EnginesMessage: {
        /** @enum {string} */
        type: "engines";
        engines: RunnerApi["Robot"][];
    };
    /**
     * EntryShown
     * @description A start that waits. `robots`: those that may move, none in the simulator; `differs`: sentences
     *     about what is no longer as it was when it was put there; `ready_at`: since when it may be started;
     *     `hidden`: the reader may not see its graph; `obstacle`: why it can only be removed, "" for all others.
     */
    EntryShown: {
        id: string;
        graph: string | null;
        graph_name: string;
        version: string;
        digest: string;
        engine: string;
        robots: string[];
        values: {
            [key: string]: {
                [key: string]: boolean | number | string | (boolean | number | string)[];
            };
        };
        author: RunnerApi["Author"];
        /** Format: date-time */
        entered_at: string;
        by_itself: boolean;
        /** @enum {string} */
        state: "changed" | "closed" | "ready" | "waiting";
        waits: RunnerApi["WaitingShown"][];
        differs: string[];
        ready_at: string | null;
        hidden: boolean;
        obstacle: string;
    };
    /**
     * EntryStarted
     * @description The run that an entry has become. Of a start on several robots: `others`, the runs beside it, and
     *     `failed`, the robots that nothing was sent to, and why.
     */
    EntryStarted: {
        id: string;
        number: number;
        graph: string | null;
        graph_name: string;
        version: string | null;
        digest: string;
        engine: string;
        simulated: boolean;
        author: RunnerApi["Author"];
        /** @enum {string} */
        state: "error" | "finished" | "halted" | "lost" | "paused" | "published" | "refused" | "requested" | "running" | "stopped" | "stopping" | "unknown";
        /** @enum {string} */
        desired: "paused" | "running" | "stopped";
        result: ("on_error" | "on_false" | "on_halted" | "on_stopped" | "on_true") | null;
        proof_at: string | null;
        unknown_since: string | null;
        unconfirmed: string | null;
        at_rest: RunnerApi["AtRestShown"] | null;
        moves_again_at: string | null;
        group: string | null;
        /** Format: date-time */
        requested_at: string;
        started_at: string | null;
        ended_at: string | null;
        took: RunnerApi["DurationBounds"] | null;
        stopped_by: RunnerApi["Author"] | null;
        detail: string;
        alarms: RunnerApi["AlarmShown"][];
        recorded: boolean;
        robots: {
            [key: string]: string;
        } | null;
        held: RunnerApi["HeldShown"] | null;
        breakpoints?: RunnerApi["Breakpoint"][];
        lead?: RunnerApi["Author"];
        batons?: string[];
        watching?: string[];
        hidden?: boolean;
        values?: {
            [key: string]: {
                [key: string]: boolean | number | string | (boolean | number | string)[];
            };
        };
        sent_digest?: string;
        from?: RunnerApi["StartFromShown"];
        people?: {
            [key: string]: string;
        };
        questions?: RunnerApi["QuestionShown"][];
        pauses?: RunnerApi["PauseShown"][];
        repeat?: RunnerApi["PartOfRepeat"];
        like: string | null;
        behaviours: boolean;
        actions: {
            [key: string]: RunnerApi["ActionShown"];
        };
        log: RunnerApi["MessageShown"][];
        rests?: RunnerApi["RobotRestShown"][];
        others: RunnerApi["RunShown"][];
        failed: {
            [key: string]: string;
        };
    };
    /**
     * Expect
     * @description A request to expect a course under a name: that of a `run`, or that of a graph in a dry-run
     *     with this script. `subgraphs`: the graphs inside of that graph.
     */
    Expect: {
        name: string;
        /** @default  */
        run?: string;
        /** @default  */
        graph?: string;
        /** @description The UMRF graph itself, as approved, or a string that holds its JSON text */
        umrf?: {
            [key: string]: unknown;
        } | string;
        script?: RunnerApi["Script"];
        /** @default [] */
        subgraphs?: RunnerApi["SentSubgraph"][];
    };
    /**
     * Expectation
     * @description A saved expectation, with everything that simulating it again takes. `subgraphs`: the graphs
     *     inside; `opened`: the run had opened them, and `umrf` is the opened graph.
     */
    Expectation: {
        name: string;
        run: string;
        graph: string | null;
        graph_name: string;
        author: RunnerApi["Author"];
        /** @description A UMRF graph. */
        umrf: {
            [key: string]: unknown;
        };
        script: {
            [key: string]: unknown;
        };
        course: RunnerApi["ExpectedStep"][];
        subgraphs: RunnerApi["SubgraphShown"][];
        opened: boolean;
    };
    /**
     * ExpectedStep
     * @description One step of a course: it concerns one action of the graph `graph`, or this graph itself if no
     *     action is named. `how` is the result, state, response or hazard code that `what` announces.
     */
    ExpectedStep: {
        graph: string;
        node: string;
        /** @enum {string} */
        what: "ends" | "hazard" | "result" | "runs" | "state";
        how: string;
    };
    /**
     * Fault
     * @description A condition that a person has to mend. `what`: a stable name; `text`: a sentence; `since`: when
     *     this process saw it first.
     */
    Fault: {
        what: string;
        text: string;
        /** Format: date-time */
        since: string;
    };
    /**
     * Field
     * @description A field that has another value than before. `before` or `after` is null if the field had no
     *     value then.
     */
    Field: {
        field: string;
        before: unknown;
        after: unknown;
    };
    /**
     * GoOnRequest
     * @description Lets a held run go on. `since`: the `since` of `held`, as the person saw it; a run that has gone
     *     on meanwhile has another one. `request_id`: names this press; if it has counted already, a repeat
     *     changes nothing and is answered with the run as it is now. `watching`: as in `StartRequest`.
     */
    GoOnRequest: {
        /** Format: date-time */
        since: string;
        /** @default  */
        request_id?: string;
        /** @default {} */
        watching?: {
            [key: string]: boolean;
        };
    };
    /**
     * GraphFile
     * @description A file that was written into an index folder. `kept`: the path to which the file that it
     *     replaced was moved.
     */
    GraphFile: {
        graph: string;
        path: string;
        digest: string;
        /** @default  */
        kept?: string;
    };
    /**
     * GroupRequest
     * @description One version for several robots at once. Without version, digest and `request_id` it is only
     *     good for a pre-flight.
     */
    GroupRequest: {
        /** @description The UMRF graph itself, as approved, or a string that holds its JSON text */
        umrf: {
            [key: string]: unknown;
        } | string;
        /** @default  */
        version?: string;
        /** @default  */
        digest?: string;
        engines: string[];
        /** @default  */
        request_id?: string;
        /** @default null */
        graph?: string | null;
        /** @default null */
        override?: RunnerApi["Override"] | null;
        /** @default null */
        like?: string | null;
        /** @default false */
        behaviours?: boolean;
        /** @default [] */
        subgraphs?: RunnerApi["SentSubgraph"][];
        /** @default null */
        tree_digest?: string | null;
        /** @default {} */
        robots?: {
            [key: string]: string;
        };
        /** @default {} */
        people?: {
            [key: string]: string;
        };
        /**
         * @default stop
         * @enum {string}
         */
        lost?: "stop" | "wait";
        /** @default {} */
        watching?: {
            [key: string]: boolean;
        };
        /** @default false */
        drill?: boolean;
        /** @default null */
        sight?: RunnerApi["Sight"] | null;
        /** @default [] */
        breakpoints?: RunnerApi["Breakpoint"][];
        /** @default {} */
        values?: {
            [key: string]: {
                [key: string]: boolean | number | string | (boolean | number | string)[];
            };
        };
        /** @default null */
        from?: RunnerApi["StartFrom"] | null;
        /**
         * @default one_step
         * @enum {string}
         */
        levels?: "one_step" | "opened";
    };
    /**
     * GroupShown
     * @description The runs that were started together. `failed`: robots that nothing was sent to, and why.
     */
    GroupShown: {
        id: string;
        runs: RunnerApi["RunShown"][];
        failed: {
            [key: string]: string;
        };
    };
    /**
     * HardwareStopShown
     * @description Names the topic on which a robot reports its hardware stop. `age_s`: seconds after which the newest message is too old.
     *     Of `bool`, `pressed` is the value that means pressed; of `diagnostics`, the status with the name `status`
     *     at this `level` or above means pressed.
     */
    HardwareStopShown: {
        topic: string;
        /** @enum {string} */
        kind: "bool" | "diagnostics";
        age_s: number;
        pressed: boolean;
        status: string;
        level: number;
    };
    /**
     * HardwareStopWanted
     * @description Names the topic on which a robot reports its hardware stop. `age_s`: seconds after which the newest message is too old.
     *     Of `bool`, `pressed` is the value that means pressed; of `diagnostics`, a status with this name ("" for
     *     every status) at this `level` or above means pressed.
     */
    HardwareStopWanted: {
        topic: string;
        /**
         * @default bool
         * @enum {string}
         */
        kind?: "bool" | "diagnostics";
        /** @default 1 */
        age_s?: number;
        /** @default true */
        pressed?: boolean;
        /** @default  */
        status?: string;
        /** @default 2 */
        level?: number;
    };
    /**
     * Health
     * @description The answer of a process that is alive. `commit`: of this program, null if unknown.
     */
    Health: {
        status: string;
        version: string;
        commit: string | null;
    };
    /**
     * HealthCheckShown
     * @description Names something of a robot's health, and what follows for a start there. Of `battery`, a share of
     *     charge below `below` percent is poor; of `diagnostics`, the status with the name `status` at this
     *     `level` or above. `age_s`: seconds after which the newest message says nothing any more; `poor`,
     *     `unknown`: what follows where it is that.
     */
    HealthCheckShown: {
        topic: string;
        /** @enum {string} */
        kind: "battery" | "diagnostics";
        below: number;
        status: string;
        level: number;
        age_s: number;
        /** @enum {string} */
        poor: "block" | "warn";
        /** @enum {string} */
        unknown: "block" | "warn";
    };
    /**
     * HealthShown
     * @description A report of a robot's health as it was when the robot was read. `text`: all of it in words, but its
     *     age; `follows`: for a start, null for nothing; `heard_at`: when its newest message came.
     */
    HealthShown: {
        topic: string;
        /** @enum {string} */
        state: "fine" | "poor" | "unknown";
        text: string;
        follows: ("block" | "warn") | null;
        heard_at: string | null;
    };
    /**
     * HealthWanted
     * @description Names something of a robot's health, and what follows for a start there. Of `battery`, a share of
     *     charge below `below` percent is poor; of `diagnostics`, the status with the name `status` at this
     *     `level` or above (1: warning, 2: error). `age_s`: seconds after which the newest message says nothing any
     *     more; `poor`, `unknown`: what follows where it is that; `unknown` is null for the same as `poor`.
     */
    HealthWanted: {
        topic: string;
        /**
         * @default battery
         * @enum {string}
         */
        kind?: "battery" | "diagnostics";
        /** @default 30 */
        below?: number;
        /** @default  */
        status?: string;
        /** @default 2 */
        level?: number;
        /** @default 30 */
        age_s?: number;
        /**
         * @default warn
         * @enum {string}
         */
        poor?: "block" | "warn";
        /** @default null */
        unknown?: ("block" | "warn") | null;
    };
    /**
     * Heartbeat
     * @description Sent once a second while the link is alive. `seen`: when each open run was last shown by its
     *     engine; `heard`: when each robot last answered.
     */
    Heartbeat: {
        /** @enum {string} */
        type: "beat";
        /** Format: date-time */
        at: string;
        seen: {
            [key: string]: string;
        };
        heard: {
            [key: string]: string;
        };
    };
    /**
     * HeldGraph
     * @description A graph that an engine holds, also an ended one. `run`: the id of this runner's run, if it is
     *     one. `stopping`: why a Stop of it is not proven yet, "" at first; null without a Stop.
     */
    HeldGraph: {
        graph: string;
        state: string;
        active: boolean;
        run: string | null;
        stopping: string | null;
    };
    /**
     * HeldShown
     * @description The hold of a led run, which begins nothing further: by whom (null: by the runner), why, and
     *     since when. `how`: by a fault, by a person, after a step, or at a breakpoint; `next`: the actions
     *     that wait to begin, the one that has waited longest first.
     */
    HeldShown: {
        by: RunnerApi["Author"] | null;
        why: string;
        /** Format: date-time */
        since: string;
        /**
         * @default trouble
         * @enum {string}
         */
        how?: "breakpoint" | "step" | "trouble" | "wait";
        /** @default [] */
        next?: RunnerApi["NextShown"][];
    };
    /**
     * Hello
     * @description The first message: all engines and all open runs.
     */
    Hello: {
        /** @enum {string} */
        type: "hello";
        engines: RunnerApi["Robot"][];
        runs: RunnerApi["RunShown"][];
    };
    /**
     * HereMessage
     * @description The answer of a page that is visible to `there`, with its number. It gets none itself.
     */
    HereMessage: {
        /** @enum {string} */
        type: "here";
        number: number;
    };
    /**
     * HistoryEvent
     * @description One stored event, for programs that follow a run.
     */
    HistoryEvent: {
        seq: number;
        kind: string;
        author: string;
        /** Format: date-time */
        at: string;
        body: unknown;
    };
    /**
     * HolderShown
     * @description The holder of a baton. `here`: they have a page open; `falls_at`: when the baton falls if they
     *     open none, null while they are here.
     */
    HolderShown: {
        person: RunnerApi["PersonRef"];
        /** Format: date-time */
        since: string;
        here: boolean;
        falls_at: string | null;
    };
    /**
     * IncidentRequest
     * @description The body of a request to keep a run as an incident. `editor_audit`: the rows of the editor's
     *     audit about its graph, which the runner cannot ask for; they count as told by the client.
     */
    IncidentRequest: {
        /** @default  */
        reason?: string;
        /** @default [] */
        editor_audit?: RunnerApi["AuditRow"][];
    };
    /**
     * IndexFolderState
     * @description The folder of files that the robot's engine indexes, as the runner sees it. `writable`:
     *     graphs that can be written there; `waiting`: graphs whose file exists and that the engine has
     *     not indexed yet; `hindered`: why other graphs cannot be written, as sentences by graph.
     */
    IndexFolderState: {
        path: string;
        writable: RunnerApi["WritableGraph"][];
        waiting: string[];
        hindered: {
            [key: string]: string;
        };
    };
    /**
     * IndexWriteAnswer
     * @description The state of the folder after a write: files that were `written` anew, files that `replaced`
     *     others, and graphs that were `there` before in the same form.
     */
    IndexWriteAnswer: {
        folder: string;
        written: RunnerApi["WrittenFile"][];
        replaced: RunnerApi["WrittenFile"][];
        there: string[];
    };
    /**
     * IndexWriteRequest
     * @description The graphs inside of a graph, as a start of it has them. `digest` is that of the graph,
     *     `tree_digest` that of all together. `replace`: names of graphs that may replace another file.
     */
    IndexWriteRequest: {
        subgraphs: RunnerApi["SentSubgraph"][];
        digest: string;
        /** @default null */
        tree_digest?: string | null;
        /** @default [] */
        replace?: string[];
    };
    /**
     * Item
     * @description One item of a pre-flight. A person may override a blocked one where `overridable`, with the
     *     codes in `codes` and a reason. `folder`: where graphs that the robot lacks could be written.
     */
    Item: {
        code: string;
        /** @enum {string} */
        verdict: "blocked" | "passed" | "warned";
        text: string;
        codes: string[];
        overridable: boolean;
        problems: RunnerApi["Problem"][];
        folder: RunnerApi["IndexFolderState"] | null;
    };
    /**
     * JournalState
     * @description The state of the journal's writer. `failing` says why the newest transaction was not stored.
     */
    JournalState: {
        database: string;
        waiting: number;
        busy_s: number;
        failing: string | null;
    };
    /**
     * KnownAction
     * @description An action that a robot has indexed.
     */
    KnownAction: {
        name: string;
        inputs: {
            [key: string]: string;
        };
        outputs: {
            [key: string]: string;
        };
    };
    /**
     * LaneState
     * @description A queue for worker processes: `waiting` requests without an answer, `busy` workers. `deaths`
     *     of workers and requests `given_up` for lack of time, both since the process began.
     */
    LaneState: {
        name: string;
        waiting: number;
        busy: number;
        deaths: number;
        given_up: number;
    };
    /**
     * Limit
     * @description The bounds of an input. `parameter`: its flat name, as `arm::torque`, or the end of it after `::`;
     *     `action`: the name of the action that has it, "" for every action; `least`, `most`: null for no bound.
     */
    Limit: {
        parameter: string;
        action: string;
        least: number | null;
        most: number | null;
    };
    /**
     * LimitWanted
     * @description The bounds of an input. `parameter`: its flat name, as `arm::torque`, or the end of it after `::`;
     *     `action`: the name of the action that has it, "" for every action; `least`, `most`: null for no bound,
     *     but not both.
     */
    LimitWanted: {
        parameter: string;
        /** @default  */
        action?: string;
        /** @default null */
        least?: number | null;
        /** @default null */
        most?: number | null;
    };
    /**
     * Listed
     * @description A run of the list, with the marks that people gave it. `cause`: one sentence why it did not
     *     end well, "" if unknown; `course`: its time in parts, empty until it is over and summed up.
     */
    Listed: {
        id: string;
        number: number;
        graph: string | null;
        graph_name: string;
        version: string | null;
        digest: string;
        engine: string;
        simulated: boolean;
        author: RunnerApi["Author"];
        /** @enum {string} */
        state: "error" | "finished" | "halted" | "lost" | "paused" | "published" | "refused" | "requested" | "running" | "stopped" | "stopping" | "unknown";
        /** @enum {string} */
        desired: "paused" | "running" | "stopped";
        result: ("on_error" | "on_false" | "on_halted" | "on_stopped" | "on_true") | null;
        proof_at: string | null;
        unknown_since: string | null;
        unconfirmed: string | null;
        at_rest: RunnerApi["AtRestShown"] | null;
        moves_again_at: string | null;
        group: string | null;
        /** Format: date-time */
        requested_at: string;
        started_at: string | null;
        ended_at: string | null;
        took: RunnerApi["DurationBounds"] | null;
        stopped_by: RunnerApi["Author"] | null;
        detail: string;
        alarms: RunnerApi["AlarmShown"][];
        recorded: boolean;
        robots: {
            [key: string]: string;
        } | null;
        held: RunnerApi["HeldShown"] | null;
        breakpoints?: RunnerApi["Breakpoint"][];
        lead?: RunnerApi["Author"];
        batons?: string[];
        watching?: string[];
        hidden?: boolean;
        values?: {
            [key: string]: {
                [key: string]: boolean | number | string | (boolean | number | string)[];
            };
        };
        sent_digest?: string;
        from?: RunnerApi["StartFromShown"];
        people?: {
            [key: string]: string;
        };
        questions?: RunnerApi["QuestionShown"][];
        pauses?: RunnerApi["PauseShown"][];
        repeat?: RunnerApi["PartOfRepeat"];
        cause: string;
        pinned: boolean;
        note: string;
        labels: string[];
        archived: RunnerApi["ArchivedShown"] | null;
        course: RunnerApi["CoursePart"][];
    };
    /**
     * Load
     * @description The resources that a process uses: seconds of processor time, bytes of memory, descriptors.
     *
     *     `loop_lag_s` is the largest lag of its event loop in the last minute. Null means that the system
     *     does not tell.
     */
    Load: {
        cpu_s: number;
        memory: number | null;
        open_files: number | null;
        most_files: number;
        loop_lag_s: number;
    };
    /**
     * LockShown
     * @description A person who has put a robot out of service, since when, and why.
     */
    LockShown: {
        by: RunnerApi["PersonRef"];
        /** Format: date-time */
        at: string;
        reason: string;
    };
    /**
     * LockWanted
     * @description Puts a robot out of service.
     */
    LockWanted: {
        reason: string;
    };
    /**
     * LookRequest
     * @description Asks for the pre-flight of an entry as it is now. `watching`: as in `StartRequest`.
     */
    LookRequest: {
        /** @default {} */
        watching?: {
            [key: string]: boolean;
        };
    };
    /**
     * LookShown
     * @description The pre-flight of an entry now. `look`: by which its start says what was looked at; `differs`: as
     *     of the entry; `overridden`: the codes of what it is started in spite of.
     */
    LookShown: {
        look: string;
        looks: RunnerApi["Preflight"][];
        differs: string[];
        overridden: string[];
    };
    /**
     * MarkShown
     * @description An event that is no observation of the engine. `since`: from when on the state was unknown.
     */
    MarkShown: {
        seq: number;
        /** Format: date-time */
        at: string;
        kind: string;
        /** @default  */
        by?: string;
        /** @default  */
        text?: string;
        since?: string;
    };
    /**
     * Marks
     * @description The marks of a run to be changed; a missing field keeps its value.
     */
    Marks: {
        /** @default null */
        pinned?: boolean | null;
        /** @default null */
        note?: string | null;
        /** @default null */
        labels?: string[] | null;
    };
    /**
     * MessageShown
     * @description A message of an action, or a line of the engine's log. `level`: of a line; left out if it is not
     *     known, as in runs of earlier versions.
     */
    MessageShown: {
        /** Format: date-time */
        at: string;
        text: string;
        /**
         * @default
         * @enum {string}
         */
        level?: "" | "debug" | "error" | "fatal" | "info" | "warn";
    };
    /**
     * ModifyRequest
     * @description Another version of the graph of a run, by value. `continue_from`: the full name of an action
     *     to start when the graph continues; `watching`, `sight`: as in
     *     `StartRequest`.
     */
    ModifyRequest: {
        version: string;
        digest: string;
        /** @description The UMRF graph itself, as approved, or a string that holds its JSON text */
        umrf: {
            [key: string]: unknown;
        } | string;
        /** @default  */
        continue_from?: string;
        /** @default null */
        override?: RunnerApi["Override"] | null;
        /** @default {} */
        watching?: {
            [key: string]: boolean;
        };
        /** @default null */
        sight?: RunnerApi["Sight"] | null;
    };
    /**
     * MoveRequest
     * @description Moves an entry. `before`: the id of the entry that comes after it then, "" for the end.
     */
    MoveRequest: {
        /** @default  */
        before?: string;
    };
    /**
     * NeverTaken
     * @description An arrow whose parent ran and certainly never ended with one of the arrow's `outcomes`.
     */
    NeverTaken: {
        parent: string;
        child: string;
        outcomes: string[];
    };
    /**
     * NewViewLink
     * @description The graph or run that a new link shows, by its id, and for how many days.
     */
    NewViewLink: {
        thing: string;
        /** @default  */
        label?: string;
        /** @default 7 */
        days?: number;
    };
    /**
     * NextRequest
     * @description Says that everything is set back, and starts the cell with this number, the next one as the person
     *     saw it. `watching`: as in `StartRequest`.
     */
    NextRequest: {
        cell: number;
        /** @default {} */
        watching?: {
            [key: string]: boolean;
        };
    };
    /**
     * NextShown
     * @description An action (by its full name) that is ready to begin, and its robot.
     */
    NextShown: {
        action: string;
        robot: string;
    };
    /**
     * NoteChange
     * @description A note or frame that was added, removed or changed. `text`: its text after the change, or
     *     before it if the note was removed.
     *
     *     `moved`: True if only its position or size has changed.
     */
    NoteChange: {
        /** @enum {string} */
        change: "added" | "changed" | "removed";
        id: string;
        text: string;
        moved: boolean;
    };
    /**
     * NoteText
     * @description A note for a moment of a run. `moment`: without it, now; for a run that is over, its end.
     *     `request_id`: names this request; a repeat by the same person adds no second note.
     */
    NoteText: {
        text: string;
        /** @default null */
        moment?: string | null;
        /** @default  */
        request_id?: string;
    };
    /**
     * OpenQueueRequest
     * @description Opens the closed queue of a robot again after a look. `closing`: that of the queue, as the person
     *     saw it.
     */
    OpenQueueRequest: {
        closing: string;
    };
    /**
     * OperatorShown
     * @description A person or a group, by id, who may start on a robot. `until`: when that ends; null for never.
     */
    OperatorShown: {
        id: string;
        name: string;
        until: string | null;
    };
    /**
     * OperatorWanted
     * @description A person or a group, by id, who may start on a robot. `name`: for sentences; `until`: when that
     *     ends, null for never.
     */
    OperatorWanted: {
        id: string;
        /** @default  */
        name?: string;
        /** @default null */
        until?: string | null;
    };
    /**
     * OrderLine
     * @description A part of an order in words. `what`: its name, as "Limit"; `text`: what it is.
     */
    OrderLine: {
        what: string;
        text: string;
    };
    /**
     * Origin
     * @description The connection by which a person acted, as an event keeps it.
     *
     *     `name`: of the person at that time. `session`: the id of the browser's session. `token`: the id of
     *     a program's token, "server" for that of the owner. `address`: on the network, "" for the computer
     *     of the server itself.
     */
    Origin: {
        /** @default  */
        name?: string;
        /** @default  */
        session?: string;
        /** @default  */
        token?: string;
        /** @default  */
        address?: string;
    };
    /**
     * OutcomeArrow
     * @description One arrow together with one outcome of its parent. `parent` and `child` are keys of actions,
     *     or `entry` and `exit`.
     */
    OutcomeArrow: {
        parent: string;
        child: string;
        /** @enum {string} */
        outcome: "on_error" | "on_false" | "on_stopped" | "on_true";
    };
    /**
     * Overridden
     * @description A problem that would have blocked a start, with the words of its pre-flight. `aid` (the key
     *     of the action) and `path` are its place in the graph that was sent.
     */
    Overridden: {
        code: string;
        text: string;
        aid?: string;
        /** @default  */
        path?: string;
    };
    /**
     * Override
     * @description The codes of problems that a person overrides with a start, and the reason.
     */
    Override: {
        codes: string[];
        reason: string;
    };
    /**
     * OwnConfirmation
     * @description The last confirmation of the session that asks; null if there was none.
     */
    OwnConfirmation: {
        last: RunnerApi["Confirmation"] | null;
    };
    PageMessage: RunnerApi["StopMessage"] | RunnerApi["HereMessage"];
    /**
     * PagePresence
     * @description The rule that the page of whoever is responsible for a run stays visible. Seconds without an
     *     answer of one: after `wait_s` a led run begins nothing further, after `stop_s` each run is
     *     stopped.
     */
    PagePresence: {
        wait_s: number;
        stop_s: number;
    };
    /**
     * PagePresenceWanted
     * @description The rule that the page of whoever is responsible for a run stays visible. Seconds without an
     *     answer of one: after `wait_s` a led run begins nothing further, after `stop_s` each run is
     *     stopped.
     */
    PagePresenceWanted: {
        wait_s: number;
        stop_s: number;
    };
    /**
     * PartOfRepeat
     * @description The place of a run in a repeat: its id, and the number of the cell, from 1.
     */
    PartOfRepeat: {
        id: string;
        cell: number;
    };
    /**
     * Parting
     * @description The earliest visit in which the runs differ, in a sentence, with the messages of the
     *     action.
     */
    Parting: {
        step: RunnerApi["ComparedVisit"];
        text: string;
        messages_a: string[];
        messages_b: string[];
    };
    /**
     * PartingCause
     * @description An event of one run that explains why the runs differ: a command of a person, an alarm, or
     *     the script of the simulator. `run`: the number of that run.
     */
    PartingCause: {
        kind: string;
        run: number;
        text: string;
    };
    /**
     * PauseShown
     * @description An action for which the runner waits, until about a moment.
     */
    PauseShown: {
        action: string;
        /** Format: date-time */
        until: string;
    };
    /**
     * PersonFile
     * @description A person as the file says. `groups`: ids of groups. `until`: seconds since 1970 after which
     *     the person may do nothing but Stop; null for no such end.
     */
    PersonFile: {
        id: string;
        name: string;
        /** @enum {string} */
        role: "editor" | "operator" | "owner" | "viewer";
        /** @default [] */
        groups?: string[];
        /** @default null */
        until?: number | null;
    };
    /**
     * PersonRef
     * @description A person who acted. `id` is opaque and stable for a browser; people choose `name` themselves.
     */
    PersonRef: {
        id: string;
        name: string;
    };
    /**
     * PhotoStored
     * @description The id of a photo that was stored, with which a question is answered.
     */
    PhotoStored: {
        photo: string;
    };
    /**
     * PlaceInside
     * @description The place of a problem within a sub-graph.
     *
     *     `levels` are the full names of the actions that lead there and `aids` their ids: from the action
     *     of the graph around it, down to the one that stands for `graph`. `where` is in the text of that
     *     graph, whose own problem has this `code` and `message`.
     */
    PlaceInside: {
        levels: string[];
        aids: string[];
        graph: string;
        code: string;
        message: string;
        /** @default {} */
        where?: RunnerApi["Where"];
    };
    /**
     * Preflight
     * @description The pre-flight of a graph on one engine. `override`: the codes that a person would have to
     *     answer for; `never`: some item cannot be overridden; `digest`: of the graph that was checked,
     *     `tree_digest`: of it together with the graphs inside; `order_digest`: of all that a second person
     *     says yes to, "" where nobody has to, and `order` that in words; `earlier`: what the start takes for
     *     granted, on the first engine of it, null if it begins at the entry.
     */
    Preflight: {
        engine: string;
        digest: string;
        tree_digest: string;
        items: RunnerApi["Item"][];
        override: string[];
        never: boolean;
        order_digest: string;
        earlier: RunnerApi["EarlierShown"] | null;
        order: RunnerApi["OrderLine"][];
    };
    /**
     * Problem
     * @description A fact about a graph that a person should know. Checks return problems and never raise.
     *
     *     `also`: the other places of the same problem, which is reported once. `inside`: its place within
     *     a sub-graph.
     */
    Problem: {
        code: string;
        /** @enum {string} */
        severity: "error" | "warning";
        where: RunnerApi["Where"];
        message: string;
        fix?: string;
        /** @default [] */
        also?: RunnerApi["Where"][];
        inside?: RunnerApi["PlaceInside"];
    };
    /**
     * ProblemDetails
     * @description The description of a refusal for a client.
     *
     *     `type` is stable; `detail` is for people. `request_id` finds the lines of the log.
     */
    ProblemDetails: {
        type: string;
        title: string;
        status: number;
        detail: string;
        where?: {
            /** @description A JSON pointer into what was sent */
            path?: string;
            line?: number;
            column?: number;
        };
        request_id?: string | null;
    };
    /**
     * ProcessStatus
     * @description The present state of one of the two processes. Only the editor knows `backups`. `faults`: what
     *     a person has to mend.
     */
    ProcessStatus: {
        /** @enum {string} */
        process: "editor" | "runner";
        /** Format: date-time */
        at: string;
        /** Format: date-time */
        began_at: string;
        versions: RunnerApi["ProcessVersions"];
        readiness: RunnerApi["Readiness"];
        load: RunnerApi["Load"];
        journal: RunnerApi["JournalState"];
        storage: RunnerApi["StorageShown"] | null;
        workers: RunnerApi["LaneState"][];
        activity: RunnerApi["Activity"];
        backups: RunnerApi["BackupsShown"] | null;
        faults: RunnerApi["Fault"][];
    };
    /**
     * ProcessVersions
     * @description The versions of the program, of its Python, and of the tables in its database.
     */
    ProcessVersions: {
        program: string;
        python: string;
        schema: string;
    };
    /**
     * ProposalRequest
     * @description A graph, and the outcome of an arrow that a test is to take.
     */
    ProposalRequest: {
        /** @description The UMRF graph itself, as approved, or a string that holds its JSON text */
        umrf: {
            [key: string]: unknown;
        } | string;
        arrow: RunnerApi["OutcomeArrow"];
        /** @default [] */
        subgraphs?: RunnerApi["SentSubgraph"][];
    };
    /**
     * QuestionShown
     * @description A question to people that is open. `action`: its full name; `aid`: its key in the graph; `visit`: of
     *     the action, from 1. `text`: the question; `choices`: of a choice; `at_least`, `at_most`: of a number.
     *     `deadline`: until when somebody has to answer, with `at_deadline` as the outcome then; `lapses_at`: when
     *     it is asked again, with another id, since a robot may move next. `role`: the actor in the graph, `to`:
     *     the id of the person or group who may answer, "" for all who may run it; `moves`: the robots that
     *     may move next, which whoever answers has to be allowed to operate. `again`: the id of the question
     *     that it repeats.
     */
    QuestionShown: {
        id: string;
        action: string;
        visit: number;
        /** @enum {string} */
        kind: "choice" | "confirm" | "number" | "photo" | "text";
        text: string;
        /** Format: date-time */
        asked_at: string;
        aid?: string;
        /** @default [] */
        choices?: string[];
        at_least?: number;
        at_most?: number;
        deadline?: string;
        at_deadline?: "error" | "false" | "stopped";
        lapses_at?: string;
        /** @default  */
        role?: string;
        /** @default  */
        to?: string;
        /** @default [] */
        moves?: string[];
        /** @default  */
        again?: string;
    };
    /**
     * QuestionsShown
     * @description The questions of a run: those that are open, the newest first of the others, and the waits.
     */
    QuestionsShown: {
        open: RunnerApi["QuestionShown"][];
        closed: RunnerApi["ClosedQuestion"][];
        pauses: RunnerApi["PauseShown"][];
    };
    /**
     * QueueClosedShown
     * @description The reason why the queue of a robot is closed, in words. `closing`: by which a person says that
     *     they have seen it; `by`: the person who caused it, `run`: the run that did.
     */
    QueueClosedShown: {
        closing: string;
        /** @enum {string} */
        why: "baton" | "complete" | "looked" | "lost" | "moves" | "person" | "refused" | "restart" | "run" | "stop";
        text: string;
        /** Format: date-time */
        at: string;
        by: RunnerApi["Author"] | null;
        run: string | null;
    };
    /**
     * QueueMessage
     * @description The queue has changed: so many starts wait in it, and of the person of this page so many may be
     *     started now, the newest one since `ready_at`. The first message comes if something waits.
     */
    QueueMessage: {
        /** @enum {string} */
        type: "queue";
        number: number;
        yours: number;
        ready_at: string | null;
    };
    /**
     * QueueRequest
     * @description Puts a start into the queue. `by_itself`: in the simulator alone, it starts when its turn comes.
     *     The `request_id` of the start names the entry: it is put there once. `engines`: of a start on several
     *     robots all of these, the `engine` of the start among them; each gets the whole graph.
     */
    QueueRequest: {
        start: RunnerApi["StartRequest"];
        /** @default false */
        by_itself?: boolean;
        /** @default [] */
        engines?: string[];
    };
    /**
     * QueueShown
     * @description All entries in their order, and the queues of the robots for which something waits.
     */
    QueueShown: {
        entries: RunnerApi["EntryShown"][];
        robots: RunnerApi["RobotQueueShown"][];
    };
    /**
     * QueuedStart
     * @description A start that was put into the queue. `waits`: it is there still; else it was started, or removed.
     */
    QueuedStart: {
        entry: string;
        waits: boolean;
    };
    /**
     * RawHour
     * @description An hour of raw messages of `robot`: its name, its size in bytes (gzipped), and, once it is
     *     archived, since when and in which file of the folder of archives.
     */
    RawHour: {
        name: string;
        bytes: number;
        archived_at: string | null;
        file: string | null;
        robot: string;
    };
    /**
     * RawMessages
     * @description The raw messages from the hours of a run, of all robots of a led one, oldest first.
     *     `robot`: the engine of the run; `text`: a note for people about missing ones, "" if all are on
     *     this computer.
     */
    RawMessages: {
        robot: string;
        hours: RunnerApi["RawHour"][];
        text: string;
    };
    /**
     * ReachStatus
     * @description All engines. `no_reach`: why this runner reaches none over ROS 2; "" when it can.
     *     `behaviours`: the Python behaviours that simulated runs can have; null where the runner was
     *     started without a folder of them.
     */
    ReachStatus: {
        engines: RunnerApi["Robot"][];
        no_reach: string;
        behaviours: RunnerApi["BehaviourList"] | null;
    };
    /**
     * Readiness
     * @description The answer to the question whether the process can do its work, with what prevents it.
     *
     *     `parts`: what each part lacks, null where it works. A missing `rclpy` is no problem here.
     */
    Readiness: {
        ready: boolean;
        problems: string[];
        parts?: {
            [key: string]: string | null;
        };
    };
    /**
     * ReceiverState
     * @description A receiver, and how it went. `to`: its host, or mail addresses; `kinds`: of messages that this
     *     process sends to it; `off`: why nothing is sent to it any more, "" if it is on; `waiting`: messages
     *     that are tried again; `failed`: messages that were given up in the last 30 days; `error`: the
     *     reason of the newest failure, "" if the newest try went well.
     */
    ReceiverState: {
        name: string;
        /** @enum {string} */
        way: "mail" | "webhook";
        to: string;
        kinds: string[];
        off: string;
        off_at: string | null;
        sent_at: string | null;
        tried_at: string | null;
        error: string;
        waiting: number;
        failed: number;
    };
    /**
     * Recorded
     * @description A run as a script (`behaviours`, docs/contracts.md 5.2), and where the script is a guess.
     */
    Recorded: {
        behaviours: {
            [key: string]: Record<string, unknown>[];
        };
        doubts: RunnerApi["Doubt"][];
    };
    /**
     * Recording
     * @description A file of recordings: its name (the hour, UTC) and its size in bytes.
     */
    Recording: {
        name: string;
        bytes: number;
    };
    /**
     * RefusedMessage
     * @description The reason why a message was not followed.
     */
    RefusedMessage: {
        /** @enum {string} */
        type: "refused";
        stop_id: string;
        detail: string;
    };
    /**
     * Registration
     * @description The data by which a robot is reached. `name` is the wake word that its engine answers to; an empty `rmw`
     *     means the middleware of this process. `led`: its owner allows runs that the runner leads step by
     *     step.
     */
    Registration: {
        name: string;
        /** @default 0 */
        domain?: number;
        /** @default  */
        rmw?: string;
        /** @default umrf_graph_get */
        get_service?: string;
        /** @default {} */
        profile?: {
            [key: string]: unknown;
        };
        /** @default false */
        led?: boolean;
    };
    /**
     * RelationChange
     * @description An arrow that was added, removed or changed. `parent` and `child` are full names of actions,
     *     or `entry` and `exit`.
     *
     *     `ends`: the keys of parent and child. `when`: pairs of outcome and response of an arrow that was
     *     added or removed.
     */
    RelationChange: {
        /** @enum {string} */
        change: "added" | "changed" | "removed";
        parent: string;
        child: string;
        fields: RunnerApi["Field"][];
        ends: [
            string,
            string
        ];
        when: [
            string,
            string
        ][];
    };
    /**
     * Release
     * @description A released version. `digest`: of its graph together with those inside; `by`: the owner who released
     *     it.
     */
    Release: {
        version: string;
        digest: string;
        by: RunnerApi["PersonRef"];
        /** Format: date-time */
        at: string;
    };
    /**
     * ReopenRequest
     * @description Opens a closed repeat again after a look. `closings`: how often it was closed, as the person saw it;
     *     `watching`: as in `StartRequest`.
     */
    ReopenRequest: {
        closings: number;
        /** @default {} */
        watching?: {
            [key: string]: boolean;
        };
    };
    /**
     * RepeatRequest
     * @description Opens a repeat of a start. `times`: how often each cell of the `grid` is carried out, or the start
     *     itself where there is none. `seed`: the cells of each round come in an order made of it; without one in
     *     that of the grid. `by_itself`: in the simulator alone, the next run starts when the one before has
     *     ended true. The `request_id` of the start names the repeat: it is opened once.
     */
    RepeatRequest: {
        start: RunnerApi["StartRequest"];
        /** @default 1 */
        times?: number;
        /** @default [] */
        grid?: RunnerApi["Axis"][];
        /** @default null */
        seed?: number | null;
        /** @default false */
        by_itself?: boolean;
    };
    /**
     * RepeatShown
     * @description A repeat with its cells. `next`: the number of the cell that is started next, null after the last;
     *     `finished`: how many runs finished; robots report no results, so that nothing else may be known;
     *     `parquet`: the runner can write its table as Parquet.
     */
    RepeatShown: {
        id: string;
        graph: string | null;
        graph_name: string;
        version: string;
        digest: string;
        engine: string;
        robots: string[];
        author: RunnerApi["Author"];
        /** Format: date-time */
        opened_at: string;
        times: number;
        grid: RunnerApi["Axis"][];
        seed: number | null;
        by_itself: boolean;
        total: number;
        closed: RunnerApi["ClosedShown"] | null;
        closings: number;
        reopened_by: RunnerApi["Author"] | null;
        reopened_at: string | null;
        /** @enum {string} */
        state: "between" | "closed" | "running" | "waiting";
        next: number | null;
        finished: number;
        cells: RunnerApi["Cell"][];
        parquet: boolean;
    };
    /**
     * RepeatSummary
     * @description A repeat as lists show it. `robots`: those that may move, none in the simulator; `total`: how many
     *     runs it has; `closings`: how often it was closed; `reopened_by`: who opened it again last.
     */
    RepeatSummary: {
        id: string;
        graph: string | null;
        graph_name: string;
        version: string;
        digest: string;
        engine: string;
        robots: string[];
        author: RunnerApi["Author"];
        /** Format: date-time */
        opened_at: string;
        times: number;
        grid: RunnerApi["Axis"][];
        seed: number | null;
        by_itself: boolean;
        total: number;
        closed: RunnerApi["ClosedShown"] | null;
        closings: number;
        reopened_by: RunnerApi["Author"] | null;
        reopened_at: string | null;
    };
    /**
     * ReplayFrame
     * @description The changes by one event. `head`: the changed fields of the run; `actions`: the changed
     *     actions.
     */
    ReplayFrame: {
        seq: number;
        /** Format: date-time */
        at: string;
        kind: string;
        /** @default  */
        by?: string;
        /** @default  */
        text?: string;
        head?: RunnerApi["ReplayHead"];
        /** @default {} */
        actions?: {
            [key: string]: RunnerApi["ActionFrame"];
        };
        /** @default [] */
        alarms?: RunnerApi["AlarmShown"][];
    };
    /**
     * ReplayHead
     * @description The fields of a run that one event changed; unchanged fields are absent.
     */
    ReplayHead: {
        /** @enum {string} */
        state?: "error" | "finished" | "halted" | "lost" | "paused" | "published" | "refused" | "requested" | "running" | "stopped" | "stopping" | "unknown";
        /** @enum {string} */
        desired?: "paused" | "running" | "stopped";
        result?: ("on_error" | "on_false" | "on_halted" | "on_stopped" | "on_true") | null;
        proof_at?: string | null;
        unknown_since?: string | null;
        moves_again_at?: string | null;
        started_at?: string | null;
        ended_at?: string | null;
        detail?: string;
        stopped_by?: RunnerApi["Author"];
    };
    /**
     * ReplayPageStart
     * @description The beginning of a page of the replay: after `after` events, at `at`.
     */
    ReplayPageStart: {
        after: number;
        /** Format: date-time */
        at: string;
    };
    /**
     * RestRequest
     * @description A person's statement that a run is at rest. `how`: how the person saw that.
     */
    RestRequest: {
        how: string;
    };
    /**
     * ResumeRequest
     * @description Lets a paused run go on. `watching`: as in `StartRequest`.
     */
    ResumeRequest: {
        /** @default {} */
        watching?: {
            [key: string]: boolean;
        };
    };
    /**
     * Revocation
     * @description The invitation or token that is revoked, or the session or person that is ended: exactly one
     *     of them.
     */
    Revocation: {
        /** @default null */
        invitation?: string | null;
        /** @default null */
        session?: string | null;
        /** @default null */
        person?: string | null;
        /** @default null */
        token?: string | null;
    };
    /**
     * RightShown
     * @description The rights of the asker on a robot. `why`: why they may not start there, "" if they may, perhaps
     *     after they have confirmed who they are; `holds`:
     *     they hold its baton; `may_take`: they may take its baton, with a reason if somebody holds it.
     */
    RightShown: {
        robot: string;
        why: string;
        holds: boolean;
        may_take: boolean;
    };
    /**
     * RightsShown
     * @description The rights of the asker on all robots. `people`: those who have a page open and may start on
     *     robots, to whom a baton can be handed.
     */
    RightsShown: {
        robots: RunnerApi["RightShown"][];
        people: RunnerApi["PersonRef"][];
    };
    /**
     * RightsWanted
     * @description The rules of an owner for a robot. `operators`: who may start there, "all" for every operator;
     *     `baton`: only the holder of its baton may; `watched`: each start has the word of its person that
     *     they watch it; `drill_days`: its last Stop drill is so old at most, null for no such rule;
     *     `released_only`: only versions start there that an owner has released;
     *     `ask_again`: minutes after which whoever starts there confirms again that it is they, 0 for never;
     *     `limits`: of the numbers that are sent there; `hardware_stop`: where it is reported, null where it is not;
     *     `page_presence`: null where no page has to stay visible; `health`: looked at before a start; where one of
     *     these is missing, it stays as it is.
     */
    RightsWanted: {
        /** @default all */
        operators?: "all" | RunnerApi["OperatorWanted"][];
        /** @default false */
        baton?: boolean;
        /** @default false */
        watched?: boolean;
        /** @default null */
        drill_days?: number | null;
        /** @default false */
        released_only?: boolean;
        /** @default 0 */
        ask_again?: number;
        limits?: RunnerApi["LimitWanted"][];
        hardware_stop?: RunnerApi["HardwareStopWanted"] | null;
        page_presence?: RunnerApi["PagePresenceWanted"] | null;
        health?: RunnerApi["HealthWanted"][];
    };
    /**
     * Robot
     * @description An engine as people see it. `why`: explains any state but `answering`.
     *
     *     `heard_at`, `took_ms`: when its last answer came, and after how many milliseconds; `restarted_at`:
     *     when its last restart was seen, null for none; `holds`: the graphs in its last answer. `servers`:
     *     how many engines answer on the path of its get; `others`: publishers of starts besides this
     *     runner. `actions`, `graphs`: the size of its index; null before its first answer.
     *     `pauses`: pausing is safe on it. `operators`: who may start there, "all" for every operator;
     *     `baton`: only its `holder` may, null being nobody; `locks`: who has put it out of service;
     *     `watched`: each start has the word of its person that they watch it; `drill_days`: how old its last
     *     Stop drill may be; `drill_due`: why one has to be made before the next start, "" if none has to be;
     *     `drills`: the newest 20, the newest first; `released_only`: only released versions start there;
     *     `ask_again`: minutes after which whoever starts there confirms again that it is they, 0 for never;
     *     `limits`: of the numbers that are sent there; `hardware_stop`: where it is reported, null where it
     *     is not; `pressed`: why it counts as pressed, "" if it does not; `page_presence`: for how long the page
     *     of whoever is responsible for a run may be missing there, null where none is asked for;
     *     `health_checks`: looked at before a start; `health`: what they show. `practice_ended`: it is the
     *     practice robot, and nobody answers there, so `POST /api/practice` starts it again.
     */
    Robot: {
        name: string;
        simulated: boolean;
        state: ("answering" | "busy" | "gone" | "restarted") | "no_link";
        why: string;
        since: string | null;
        domain: number | null;
        rmw: string;
        get_service: string;
        profile: {
            [key: string]: unknown;
        };
        led: boolean;
        heard_at: string | null;
        took_ms: number | null;
        restarted_at: string | null;
        /** @enum {string} */
        generation: "current" | "older" | "unknown";
        servers: number;
        others: number;
        actor: string;
        pauses: boolean;
        holds: RunnerApi["HeldGraph"][];
        actions: number | null;
        graphs: number | null;
        operators: "all" | RunnerApi["OperatorShown"][];
        baton: boolean;
        holder: RunnerApi["HolderShown"] | null;
        locks: RunnerApi["LockShown"][];
        watched: boolean;
        drill_days: number | null;
        drill_due: string;
        drills: RunnerApi["DrillShown"][];
        released_only: boolean;
        ask_again: number;
        limits: RunnerApi["Limit"][];
        hardware_stop: RunnerApi["HardwareStopShown"] | null;
        pressed: string;
        page_presence: RunnerApi["PagePresence"] | null;
        health_checks: RunnerApi["HealthCheckShown"][];
        health: RunnerApi["HealthShown"][];
        practice_ended: boolean;
    };
    /**
     * RobotChange
     * @description The fields of a registration to change; null leaves a field as it is.
     */
    RobotChange: {
        /** @default null */
        domain?: number | null;
        /** @default null */
        rmw?: string | null;
        /** @default null */
        get_service?: string | null;
        /** @default null */
        profile?: {
            [key: string]: unknown;
        } | null;
        /** @default null */
        led?: boolean | null;
    };
    /**
     * RobotKnowledge
     * @description The actions and graphs that a robot has indexed. `unread`: how many files of its index cannot
     *     be read.
     */
    RobotKnowledge: {
        actions: RunnerApi["KnownAction"][];
        graphs: string[];
        unread: number;
    };
    /**
     * RobotLink
     * @description The state of the connection to a robot, and when it last answered.
     */
    RobotLink: {
        name: string;
        state: string;
        why: string;
        heard_at: string | null;
    };
    /**
     * RobotLogLine
     * @description A line of a robot's flight record. `has_graph`: its graph can be fetched; `graphs`: names of
     *     graphs for its index; `files`: the files that were written for it. Of a change of its rights,
     *     `sender`: who made it, "" for the runner; `how`: how its baton passed, from `was` to `to`.
     */
    RobotLogLine: {
        seq: number;
        /** Format: date-time */
        at: string;
        /** @enum {string} */
        kind: "baton" | "became" | "commanded" | "drilled" | "index_write_asked" | "index_written" | "locked" | "rights_set" | "stop_asked" | "stop_proven" | "stop_unproven" | "unlocked";
        command: string;
        graph: string;
        sender: string;
        state: string;
        why: string;
        run: string | null;
        number: number | null;
        has_graph: boolean;
        graphs: string[];
        files: RunnerApi["GraphFile"][];
        how: ("dropped" | "fell" | "forced" | "handed" | "off" | "taken") | "";
        was: string;
        to: string;
    };
    /**
     * RobotQueueShown
     * @description The queue of one robot, or of the simulator, by the ids of its entries in their order.
     */
    RobotQueueShown: {
        robot: string;
        entries: string[];
        closed: RunnerApi["QueueClosedShown"] | null;
    };
    /**
     * RobotRestShown
     * @description The state of the proof that one robot of a led run is at rest. `state`: nothing of the
     *     run was ever begun there ("unused"), an action goes on ("going"), it gets Stops until rest is
     *     proven ("stopping"), it does not answer ("silent"), no answer can prove rest any more
     *     ("unproven"), an answer has proven it ("proven"), a person or the runner has seen it ("seen"),
     *     nothing of the last action began ("unsent"), or nothing was recorded of it ("unknown"). `since`:
     *     when that began; `action`, `piece`: the action and the run of its piece; `why`: the reason, or
     *     how rest was seen; `by`: who has seen it; `stops`: a Stop is asked for, and repeated until rest
     *     is proven.
     */
    RobotRestShown: {
        robot: string;
        /** @enum {string} */
        state: "going" | "proven" | "seen" | "silent" | "stopping" | "unknown" | "unproven" | "unsent" | "unused";
        since?: string;
        /** @default  */
        action?: string;
        /** @default  */
        piece?: string;
        /** @default  */
        why?: string;
        by?: RunnerApi["Author"];
        /** @default false */
        stops?: boolean;
    };
    /**
     * RobotStopped
     * @description The targets of a Stop of a robot: the ids of this runner's runs, and the names of graphs that
     *     others started.
     */
    RobotStopped: {
        runs: string[];
        graphs: string[];
    };
    /**
     * Rule
     * @description Names those who may see a graph, and those who may also edit it as far as their role allows.
     *     Editors may see it, too; with `editors` "all" everybody who may see it may edit it. Owners may do
     *     both.
     */
    Rule: {
        readers: "all" | string[];
        editors: "all" | string[];
    };
    /**
     * RunComparison
     * @description The comparison of run `a` with run `b`. `graph`: the difference of the sent graphs;
     *     `parameters`: its changes of values of actions; `subgraphs`: the names of graphs inside that
     *     differ. `because`: an event that explains the first difference of the runs, rather than any
     *     difference of the graphs; null if unknown.
     */
    RunComparison: {
        a: RunnerApi["RunSummary"];
        b: RunnerApi["RunSummary"];
        same_graph: boolean;
        same_engine: boolean;
        graph: RunnerApi["Difference"];
        parameters: RunnerApi["ActionChange"][];
        subgraphs: string[];
        steps: RunnerApi["ComparedVisit"][];
        left_out: number;
        parting: RunnerApi["Parting"] | null;
        because: RunnerApi["PartingCause"] | null;
        text: string;
    };
    /**
     * RunMarks
     * @description The marks that people gave a run.
     */
    RunMarks: {
        pinned: boolean;
        note: string;
        labels: string[];
    };
    /**
     * RunMessage
     * @description The present state of a run.
     */
    RunMessage: {
        /** @enum {string} */
        type: "run";
        run: RunnerApi["RunShown"];
    };
    /**
     * RunNote
     * @description A note that a person wrote for a moment of a run. `at`: when it was written.
     */
    RunNote: {
        /** Format: date-time */
        moment: string;
        text: string;
        author: RunnerApi["Author"];
        /** Format: date-time */
        at: string;
    };
    /**
     * RunPoint
     * @description One run of the statistics. `took`: seconds, if known exactly; `span`: its bounds, null if
     *     unknown.
     */
    RunPoint: {
        id: string;
        number: number;
        /** @enum {string} */
        state: "error" | "finished" | "halted" | "lost" | "paused" | "published" | "refused" | "requested" | "running" | "stopped" | "stopping" | "unknown";
        result: ("on_error" | "on_false" | "on_halted" | "on_stopped" | "on_true") | null;
        took: number | null;
        span: RunnerApi["DurationBounds"] | null;
    };
    /**
     * RunReplay
     * @description A page of a run's replay. `base` is the run after `after` events, null at the beginning;
     *     `newest` is the seq of the last event; `chapters`: the beginnings of all pages.
     */
    RunReplay: {
        run: string;
        after: number;
        newest: number;
        base: RunnerApi["RunShown"] | null;
        frames: RunnerApi["ReplayFrame"][];
        chapters: RunnerApi["ReplayPageStart"][];
        marks: RunnerApi["MarkShown"][];
    };
    /**
     * RunShown
     * @description A run with its actions, by full name, and the newest lines of its engine's log. `like`: the
     *     robot whose engine the simulator plays; `behaviours`: whether its actions have Python
     *     behaviours; `rests`: of a led run, how far each robot is proven to be at rest.
     */
    RunShown: {
        id: string;
        number: number;
        graph: string | null;
        graph_name: string;
        version: string | null;
        digest: string;
        engine: string;
        simulated: boolean;
        author: RunnerApi["Author"];
        /** @enum {string} */
        state: "error" | "finished" | "halted" | "lost" | "paused" | "published" | "refused" | "requested" | "running" | "stopped" | "stopping" | "unknown";
        /** @enum {string} */
        desired: "paused" | "running" | "stopped";
        result: ("on_error" | "on_false" | "on_halted" | "on_stopped" | "on_true") | null;
        proof_at: string | null;
        unknown_since: string | null;
        unconfirmed: string | null;
        at_rest: RunnerApi["AtRestShown"] | null;
        moves_again_at: string | null;
        group: string | null;
        /** Format: date-time */
        requested_at: string;
        started_at: string | null;
        ended_at: string | null;
        took: RunnerApi["DurationBounds"] | null;
        stopped_by: RunnerApi["Author"] | null;
        detail: string;
        alarms: RunnerApi["AlarmShown"][];
        recorded: boolean;
        robots: {
            [key: string]: string;
        } | null;
        held: RunnerApi["HeldShown"] | null;
        breakpoints?: RunnerApi["Breakpoint"][];
        lead?: RunnerApi["Author"];
        batons?: string[];
        watching?: string[];
        hidden?: boolean;
        values?: {
            [key: string]: {
                [key: string]: boolean | number | string | (boolean | number | string)[];
            };
        };
        sent_digest?: string;
        from?: RunnerApi["StartFromShown"];
        people?: {
            [key: string]: string;
        };
        questions?: RunnerApi["QuestionShown"][];
        pauses?: RunnerApi["PauseShown"][];
        repeat?: RunnerApi["PartOfRepeat"];
        like: string | null;
        behaviours: boolean;
        actions: {
            [key: string]: RunnerApi["ActionShown"];
        };
        log: RunnerApi["MessageShown"][];
        rests?: RunnerApi["RobotRestShown"][];
    };
    /**
     * RunSummary
     * @description A run as lists show it. `took`: the time from `started_at` until nothing was seen moving any
     *     more, which is before the proof at `ended_at`; null if unknown. `robots`: of a led run, the
     *     engine of each actor, "" being the actor of actions that name none; `held`: why it begins nothing
     *     further; `breakpoints`: where it waits; `lead`: who let it go on last, or was handed it. `batons`: the robots whose baton `author`
     *     held at the start; `watching`: those that they said to watch. `hidden`: the
     *     reader may not see its graph, so that little else is given. `values`: those that were given at the
     *     start, by action and input; `digest` is that of the version, `sent_digest` that of the graph with
     *     them, which was sent, or of the part that was. `from`: where it began, if not at the entry. `people`: who answers
     *     the questions of each actor; `questions`: those that are open; `pauses`: the actions for which the runner
     *     waits; `repeat`: of which repeat it is a cell.
     */
    RunSummary: {
        id: string;
        number: number;
        graph: string | null;
        graph_name: string;
        version: string | null;
        digest: string;
        engine: string;
        simulated: boolean;
        author: RunnerApi["Author"];
        /** @enum {string} */
        state: "error" | "finished" | "halted" | "lost" | "paused" | "published" | "refused" | "requested" | "running" | "stopped" | "stopping" | "unknown";
        /** @enum {string} */
        desired: "paused" | "running" | "stopped";
        result: ("on_error" | "on_false" | "on_halted" | "on_stopped" | "on_true") | null;
        proof_at: string | null;
        unknown_since: string | null;
        unconfirmed: string | null;
        at_rest: RunnerApi["AtRestShown"] | null;
        moves_again_at: string | null;
        group: string | null;
        /** Format: date-time */
        requested_at: string;
        started_at: string | null;
        ended_at: string | null;
        took: RunnerApi["DurationBounds"] | null;
        stopped_by: RunnerApi["Author"] | null;
        detail: string;
        alarms: RunnerApi["AlarmShown"][];
        recorded: boolean;
        robots: {
            [key: string]: string;
        } | null;
        held: RunnerApi["HeldShown"] | null;
        breakpoints?: RunnerApi["Breakpoint"][];
        lead?: RunnerApi["Author"];
        batons?: string[];
        watching?: string[];
        hidden?: boolean;
        values?: {
            [key: string]: {
                [key: string]: boolean | number | string | (boolean | number | string)[];
            };
        };
        sent_digest?: string;
        from?: RunnerApi["StartFromShown"];
        people?: {
            [key: string]: string;
        };
        questions?: RunnerApi["QuestionShown"][];
        pauses?: RunnerApi["PauseShown"][];
        repeat?: RunnerApi["PartOfRepeat"];
    };
    /**
     * RunWhole
     * @description A run with the graph that was sent. `sent`: the values of its actions, by full name and flat
     *     name, written as in `inputs` of visits. `subgraphs`: all graphs inside that were sent along;
     *     `tree_digest`: of the graph together with them, null if the starter did not send it; `earlier`: what
     *     it takes for granted, null if it began at the entry; `limits`: those of its robots at the start,
     *     or at the last change of its graph; `pages`: the rules about visible pages at the start; `health`: a
     *     sentence for each thing that its robots reported then.
     */
    RunWhole: {
        id: string;
        number: number;
        graph: string | null;
        graph_name: string;
        version: string | null;
        digest: string;
        engine: string;
        simulated: boolean;
        author: RunnerApi["Author"];
        /** @enum {string} */
        state: "error" | "finished" | "halted" | "lost" | "paused" | "published" | "refused" | "requested" | "running" | "stopped" | "stopping" | "unknown";
        /** @enum {string} */
        desired: "paused" | "running" | "stopped";
        result: ("on_error" | "on_false" | "on_halted" | "on_stopped" | "on_true") | null;
        proof_at: string | null;
        unknown_since: string | null;
        unconfirmed: string | null;
        at_rest: RunnerApi["AtRestShown"] | null;
        moves_again_at: string | null;
        group: string | null;
        /** Format: date-time */
        requested_at: string;
        started_at: string | null;
        ended_at: string | null;
        took: RunnerApi["DurationBounds"] | null;
        stopped_by: RunnerApi["Author"] | null;
        detail: string;
        alarms: RunnerApi["AlarmShown"][];
        recorded: boolean;
        robots: {
            [key: string]: string;
        } | null;
        held: RunnerApi["HeldShown"] | null;
        breakpoints?: RunnerApi["Breakpoint"][];
        lead?: RunnerApi["Author"];
        batons?: string[];
        watching?: string[];
        hidden?: boolean;
        values?: {
            [key: string]: {
                [key: string]: boolean | number | string | (boolean | number | string)[];
            };
        };
        sent_digest?: string;
        from?: RunnerApi["StartFromShown"];
        people?: {
            [key: string]: string;
        };
        questions?: RunnerApi["QuestionShown"][];
        pauses?: RunnerApi["PauseShown"][];
        repeat?: RunnerApi["PartOfRepeat"];
        like: string | null;
        behaviours: boolean;
        actions: {
            [key: string]: RunnerApi["ActionShown"];
        };
        log: RunnerApi["MessageShown"][];
        rests?: RunnerApi["RobotRestShown"][];
        /** @description A UMRF graph. */
        umrf: {
            [key: string]: unknown;
        };
        override: RunnerApi["Override"] | null;
        sent: {
            [key: string]: {
                [key: string]: string;
            };
        };
        despite: RunnerApi["Overridden"][];
        archived: RunnerApi["ArchivedShown"] | null;
        subgraphs: RunnerApi["SubgraphShown"][];
        tree_digest: string | null;
        earlier: RunnerApi["EarlierShown"] | null;
        limits: {
            [key: string]: RunnerApi["Limit"][];
        };
        pages: {
            [key: string]: RunnerApi["PagePresence"];
        };
        health: {
            [key: string]: string[];
        };
    };
    RunnerMessage: RunnerApi["Hello"] | RunnerApi["RunMessage"] | RunnerApi["EnginesMessage"] | RunnerApi["ConfirmMessage"] | RunnerApi["QueueMessage"] | RunnerApi["ThereMessage"] | RunnerApi["Heartbeat"] | RunnerApi["Stopping"] | RunnerApi["RefusedMessage"];
    /**
     * SaidShown
     * @description A person's statement of the result of a visit that no answer has shown.
     */
    SaidShown: {
        by: RunnerApi["Author"];
        /** Format: date-time */
        at: string;
        reason: string;
    };
    /**
     * Script
     * @description Behaviours of actions by key. A key has one behaviour for each call of the action; the last
     *     one repeats.
     */
    Script: {
        /** @default {} */
        behaviours?: {
            [key: string]: RunnerApi["Behaviour"][];
        };
    };
    /**
     * ScriptRequest
     * @description Another version of the graph of a run; `action` (a name of the run) may have a `fault`.
     *     `subgraphs`: the graphs inside, for a run that had opened them.
     */
    ScriptRequest: {
        /** @description The UMRF graph itself, as approved, or a string that holds its JSON text */
        umrf: {
            [key: string]: unknown;
        } | string;
        /** @default [] */
        subgraphs?: RunnerApi["SentSubgraph"][];
        /** @default null */
        action?: string | null;
        /** @default null */
        fault?: ("error" | "false" | "hang" | "init_error") | null;
    };
    /**
     * SentSubgraph
     * @description A graph inside of the sent one. `name`: of the actions that stand for it; `version`, `graph`:
     *     its source.
     */
    SentSubgraph: {
        name: string;
        /** @default  */
        digest?: string;
        /** @description The UMRF graph itself, as approved, or a string that holds its JSON text */
        umrf: {
            [key: string]: unknown;
        } | string;
        /** @default null */
        version?: string | null;
        /** @default null */
        graph?: string | null;
    };
    /**
     * ServerProof
     * @description The proof that a server knows the token.
     *
     *     It is an HMAC over a challenge and over the address, `HOST:PORT`, that accepted the connection.
     *     `token_proof`: the same under the digest of a program's token; "" if none was asked about.
     */
    ServerProof: {
        address: string;
        proof: string;
        token_proof: string;
    };
    /**
     * SessionEnd
     * @description The end of a session by its person. `seal`: from the editor's list of their devices.
     */
    SessionEnd: {
        session: string;
        person: string;
        seal: string;
    };
    /**
     * SharedBeat
     * @description Sent once a second while the run goes on. `seen`: when its engine showed it last; null if it
     *     never did.
     */
    SharedBeat: {
        /** @enum {string} */
        type: "beat";
        /** Format: date-time */
        at: string;
        seen: string | null;
    };
    /**
     * SharedRun
     * @description A run with the graph that was sent, as a link shows it.
     */
    SharedRun: {
        run: RunnerApi["SharedState"];
        /** @description A UMRF graph. */
        umrf: {
            [key: string]: unknown;
        };
    };
    /**
     * SharedState
     * @description The state of a run, as a link shows it. `unconfirmed`: a Stop of it is not proven.
     *     `seen_to_rest`: a person or the runner saw that it is at rest, since no answer could prove it.
     *     `held_since`: since when a led run begins nothing further. `robots`: of a led run, the engine of
     *     each actor.
     */
    SharedState: {
        graph_name: string;
        engine: string;
        simulated: boolean;
        /** @enum {string} */
        state: "error" | "finished" | "halted" | "lost" | "paused" | "published" | "refused" | "requested" | "running" | "stopped" | "stopping" | "unknown";
        /** @enum {string} */
        desired: "paused" | "running" | "stopped";
        result: ("on_error" | "on_false" | "on_halted" | "on_stopped" | "on_true") | null;
        /** Format: date-time */
        requested_at: string;
        started_at: string | null;
        ended_at: string | null;
        proof_at: string | null;
        unknown_since: string | null;
        moves_again_at: string | null;
        held_since: string | null;
        unconfirmed: boolean;
        seen_to_rest: boolean;
        took: RunnerApi["DurationBounds"] | null;
        recorded: boolean;
        robots: {
            [key: string]: string;
        } | null;
        rests: RunnerApi["RobotRestShown"][];
        actions: {
            [key: string]: RunnerApi["ActionShown"];
        };
    };
    /**
     * SharedStateMessage
     * @description The present state of the run of a link.
     */
    SharedStateMessage: {
        /** @enum {string} */
        type: "run";
        run: RunnerApi["SharedState"];
    };
    /**
     * Sight
     * @description The rules of a version at one time: a run of it is for those who may see all its graphs.
     *
     *     `digest`: the tree digest of the version, or its digest if it has none. `graphs`: the ids of the
     *     graph and of all graphs inside. `rules`: the rule that counts for each of them, in their order.
     *     `at`: microseconds since 1970.
     */
    Sight: {
        version: string;
        digest: string;
        graphs: string[];
        rules: RunnerApi["Rule"][];
        at: number;
        /** @default  */
        seal?: string;
    };
    /**
     * Sighting
     * @description The engines that are seen now. `left_s`: seconds during which discovery may still find
     *     others; 0 when it is complete.
     */
    Sighting: {
        engines: RunnerApi["Candidate"][];
        left_s: number;
    };
    /**
     * Spans
     * @description Percentiles of the durations of an action, each between bounds.
     */
    Spans: {
        p50: RunnerApi["DurationBounds"] | null;
        p90: RunnerApi["DurationBounds"] | null;
        p99: RunnerApi["DurationBounds"] | null;
        longest: RunnerApi["DurationBounds"] | null;
    };
    /**
     * StartFrom
     * @description The place where a start begins, if not at the entry. `run`: the earlier run whose outcomes and values count,
     *     "" for none. `at`: the actions with which it begins, by full name; without any it is continued where
     *     that run ended. `only`: nothing but these actions is played. `choices`: for each action that was
     *     under way when that run ended, by full name; `reason`: how the person knows the outcomes among
     *     them.
     */
    StartFrom: {
        /** @default  */
        run?: string;
        /** @default [] */
        at?: string[];
        /** @default false */
        only?: boolean;
        /** @default {} */
        choices?: {
            [key: string]: "again" | "error" | "false" | "leave" | "true";
        };
        /** @default  */
        reason?: string;
    };
    /**
     * StartFromShown
     * @description The place where a run began, if not at the entry. `run`, `number`: the earlier run whose outcomes and values
     *     count, "" and 0 for none; `at`: the actions with which it began, none if it continued that run where
     *     it ended; `only`: it played nothing else.
     */
    StartFromShown: {
        /** @default  */
        run?: string;
        /** @default 0 */
        number?: number;
        /** @default [] */
        at?: string[];
        /** @default false */
        only?: boolean;
    };
    /**
     * StartRequest
     * @description A start: the version by value, and the engine that runs it.
     *
     *     `digest` is that of the graph that the person saw; `request_id` is made by the client, once per
     *     intended start. `like`: the robot whose engine the simulator plays, with its hazards.
     *     `behaviours`: actions with a Python behaviour on the runner do what that does, before what the
     *     script says. `subgraphs`: all graphs inside, by value, as the version has them; `tree_digest`:
     *     the digest of the graph together with them. For the engine `conducted`, `robots` gives the robot
     *     of each actor ("" for actions without one), `people` who answers the questions of each actor: the id
     *     of a person or of a group, "" for all who may run it; `lost`: see `Led`. `watching`: true for each robot of
     *     which the person says that they watch it, with its hardware stop within reach. `drill`: the start is
     *     for a Stop drill of its robot, and so needs no earlier one. `sight`: the rules of the
     *     version, as the editor seals them; without it, where there are rules, the run is for its starter
     *     and owners. `values`: those of inputs for which the graph asks; its digest stays that without them.
     *     `from`: where it begins, if not at the entry. `levels`: in a led run a sub-graph is one step, or it is
     *     opened: the actions inside of it are steps of their own.
     */
    StartRequest: {
        version: string;
        digest: string;
        /** @description The UMRF graph itself, as approved, or a string that holds its JSON text */
        umrf: {
            [key: string]: unknown;
        } | string;
        engine: string;
        request_id: string;
        /** @default null */
        graph?: string | null;
        script?: RunnerApi["Script"];
        /** @default null */
        override?: RunnerApi["Override"] | null;
        /** @default null */
        like?: string | null;
        /** @default false */
        behaviours?: boolean;
        /** @default [] */
        subgraphs?: RunnerApi["SentSubgraph"][];
        /** @default null */
        tree_digest?: string | null;
        /** @default {} */
        robots?: {
            [key: string]: string;
        };
        /** @default {} */
        people?: {
            [key: string]: string;
        };
        /**
         * @default stop
         * @enum {string}
         */
        lost?: "stop" | "wait";
        /** @default {} */
        watching?: {
            [key: string]: boolean;
        };
        /** @default false */
        drill?: boolean;
        /** @default null */
        sight?: RunnerApi["Sight"] | null;
        /** @default [] */
        breakpoints?: RunnerApi["Breakpoint"][];
        /** @default {} */
        values?: {
            [key: string]: {
                [key: string]: boolean | number | string | (boolean | number | string)[];
            };
        };
        /** @default null */
        from?: RunnerApi["StartFrom"] | null;
        /**
         * @default one_step
         * @enum {string}
         */
        levels?: "one_step" | "opened";
    };
    /**
     * StartShown
     * @description The state of a start. `under_way`: it is being carried out now; `queued`: the entry of the queue
     *     that it has become, whose run is one of `runs`. If all of them are empty, the start has not arrived
     *     here so far.
     */
    StartShown: {
        request_id: string;
        under_way: boolean;
        runs: RunnerApi["RunShown"][];
        queued: RunnerApi["QueuedStart"] | null;
    };
    /**
     * Statement
     * @description The rules of all graphs at one time, also of deleted graphs, and of drafts, for which that of
     *     their origin counts. `graphs`: the index in `rules` of the rule that counts, by the id of the
     *     graph; graphs that are left out are open to everybody. `at`: microseconds since 1970; a later
     *     statement has a greater one.
     */
    Statement: {
        at: number;
        rules: RunnerApi["Rule"][];
        graphs: {
            [key: string]: number;
        };
        /** @default  */
        seal?: string;
    };
    /**
     * Statistics
     * @description Statistics of the newest `runs` of a graph. `judged`: runs whose known result says something
     *     about the graph (neither refused, lost nor stopped); `succeeded`: those that finished true.
     *     `unknown`: finished runs of unknown result, which robots do not report. `untold`: the number
     *     of arrows that may or may not have been taken.
     */
    Statistics: {
        runs: RunnerApi["RunPoint"][];
        judged: number;
        succeeded: number;
        unknown: number;
        actions: RunnerApi["ActionStatistics"][];
        never_taken: RunnerApi["NeverTaken"][];
        untold: number;
    };
    /**
     * StepRequest
     * @description Lets one action of a held run begin, then holds it again. `since`, `request_id`, `watching`: as in
     *     `GoOnRequest`. `action`: the full name of the one to begin, "" for the one that has waited longest;
     *     `until`: in place of it, all begin that come before this action; `over`: in place of both, all begin
     *     that are inside of this sub-graph, which is opened, as the `levels` of these actions name it.
     */
    StepRequest: {
        /** Format: date-time */
        since: string;
        /** @default  */
        request_id?: string;
        /** @default {} */
        watching?: {
            [key: string]: boolean;
        };
        /** @default  */
        action?: string;
        /** @default  */
        until?: string;
        /** @default [] */
        over?: string[];
    };
    /**
     * StopBody
     * @description The body of a Stop. The page makes one `stop_id` for each press, since one press may arrive
     *     on several ways. `again`: this is another try to send that press, since no answer came; a Stop of
     *     everything that has come before then reaches no run that was admitted since.
     */
    StopBody: {
        /** @default  */
        stop_id?: string;
        /** @default false */
        again?: boolean;
    };
    /**
     * StopMessage
     * @description A press of Stop. `run`: the id of a run or a group, or
     *     "all"; `stop_id` and `again`: as in the body of `POST /api/stop`.
     */
    StopMessage: {
        /** @enum {string} */
        type: "stop";
        run: string;
        stop_id: string;
        again: boolean;
    };
    /**
     * Stopping
     * @description The answer to a Stop: the ids of the runs that are being stopped and, if everything is
     *     stopped, the `graphs` of other programs by robot. `unknown`: by robot, why it is unknown which
     *     graphs it runs.
     */
    Stopping: {
        /** @enum {string} */
        type: "stopping";
        stop_id: string;
        runs: string[];
        graphs: {
            [key: string]: string[];
        };
        unknown: {
            [key: string]: string;
        };
    };
    /**
     * StorageShown
     * @description Bytes: free space and size of the disk of the data folder, and what the database and folders
     *     take.
     */
    StorageShown: {
        /** Format: date-time */
        at: string;
        free: number;
        size: number;
        database: number | null;
        wal: number | null;
        folders: {
            [key: string]: number;
        };
    };
    /**
     * SubgraphShown
     * @description A graph inside of the started one, as it was sent along. `name`: of the actions that stand
     *     for it; `graph`: its id; `version`: its version, null if none was named.
     */
    SubgraphShown: {
        name: string;
        version: string | null;
        digest: string;
        /** @description A UMRF graph. */
        umrf: {
            [key: string]: unknown;
        };
        graph: string | null;
    };
    /**
     * SweepResult
     * @description The result of a sweep: numbers of archived runs and hours of raw messages. `more`: others are
     *     due; `problems`: what could not be archived, and why.
     */
    SweepResult: {
        runs: number;
        raw: number;
        more: boolean;
        problems: string[];
    };
    /**
     * TakenValueShown
     * @description A value of an earlier run, with which the input `name` of `action` begins. `source`: the action that
     *     gave it, and `at` when; `text`: the value as JSON.
     */
    TakenValueShown: {
        action: string;
        name: string;
        source: string;
        text: string;
        /** Format: date-time */
        at: string;
    };
    /**
     * ThereMessage
     * @description Asks a page of an operator to answer if it is visible, while a robot asks for such pages. The
     *     answer repeats `number`, which is another one for each question.
     */
    ThereMessage: {
        /** @enum {string} */
        type: "there";
        number: number;
    };
    /**
     * TokenList
     * @description The tokens of a server. `most_days`: the longest life that a new one may get.
     */
    TokenList: {
        tokens: RunnerApi["TokenShown"][];
        most_days: number;
    };
    /**
     * TokenRecord
     * @description A token as its file has it, without the secret. `sha256`: of the whole text, in hex. `made_at`
     *     and `expires`: seconds since 1970. `invitation`: the link by which the maker came, if any.
     *     `seal`: proves that a server with the same token made it.
     */
    TokenRecord: {
        id: string;
        name: string;
        sha256: string;
        scopes: ("edit" | "hooks" | "operate" | "read" | "scrape" | "simulate")[];
        /** @enum {string} */
        role: "editor" | "operator" | "owner" | "viewer";
        person: RunnerApi["PersonRef"];
        made_at: number;
        expires: number;
        /** @default null */
        invitation?: string | null;
        /** @default  */
        seal?: string;
    };
    /**
     * TokenShown
     * @description A token in a list. `used` is missing if the process never saw it.
     */
    TokenShown: {
        record: RunnerApi["TokenRecord"];
        used?: RunnerApi["TokenUse"];
    };
    /**
     * TokenUse
     * @description The last use of a token, up to a minute old. `at`: seconds since 1970. `address`: "" for the
     *     server's own computer.
     */
    TokenUse: {
        at: number;
        address: string;
    };
    /**
     * TurnRequest
     * @description Starts an entry whose turn it is. `look`: that of the newest look, as the person saw it;
     *     `watching`: as in `StartRequest`.
     */
    TurnRequest: {
        look: string;
        /** @default {} */
        watching?: {
            [key: string]: boolean;
        };
    };
    /**
     * UnderWay
     * @description An action that had begun and had no outcome when the earlier run was stopped. `robot`: that played
     *     it; `seen`: the outcome that was seen after the Stop, "" for none.
     */
    UnderWay: {
        action: string;
        robot: string;
        /** @default  */
        seen?: ("on_error" | "on_false" | "on_stopped" | "on_true") | "";
    };
    /**
     * UnlockWanted
     * @description Takes one's own lock off a robot, or as an owner that of the person `of`.
     */
    UnlockWanted: {
        /** @default  */
        of?: string;
    };
    /**
     * ValueTest
     * @description A condition on a value by its flat name (`pose::x`). No value is unequal to all.
     */
    ValueTest: {
        name: string;
        /** @enum {string} */
        test: "!=" | "<" | "<=" | "==" | ">" | ">=";
        value: boolean | number | string;
    };
    /**
     * ViewLink
     * @description A link as owners see it. `path` follows the address of the page, and holds the secret.
     *     `opened`: how often somebody opened it, `opened_at` the last time.
     */
    ViewLink: {
        id: string;
        /** @enum {string} */
        kind: "graph" | "run";
        thing: string;
        label: string;
        made_by: RunnerApi["PersonRef"];
        /** Format: date-time */
        made_at: string;
        /** Format: date-time */
        expires: string;
        path: string;
        opened: number;
        opened_at: string | null;
    };
    /**
     * VisitShown
     * @description One visit of an action. It began between `not_before` and `from`, and ended between `until`
     *     (null: no end was seen) and `not_after` (null: it may still be running). If `until` is before
     *     `from`, there is no time at which it ran for certain. `inputs`: the values that the engine
     *     reported, by flat name, as JSON texts (a long one is cut and ends with an ellipsis); null if
     *     none were seen; `outputs`: likewise those that it gave, where an answer could show them. In a
     *     led run, `robot`: the engine that played it ("people", or "runner" for a wait); `said`: the person who
     *     stated the result, where no answer has shown it; `answered`: the person who was asked, with the
     *     answer.
     */
    VisitShown: {
        /** Format: date-time */
        from: string;
        /** Format: date-time */
        not_before: string;
        not_after: string | null;
        until: string | null;
        result: ("error" | "false" | "stopped" | "true") | null;
        /** @enum {string} */
        how: "inferred" | "observed";
        inputs: {
            [key: string]: string;
        } | null;
        robot?: string;
        said?: RunnerApi["SaidShown"];
        outputs?: {
            [key: string]: string;
        };
        answered?: RunnerApi["AnswerShown"];
    };
    /**
     * WaitRequest
     * @description Lets a led run begin nothing further. `reason`: shown to everybody; `request_id`: as in
     *     `GoOnRequest`.
     */
    WaitRequest: {
        /** @default  */
        reason?: string;
        /** @default  */
        request_id?: string;
    };
    /**
     * Waiting
     * @description The open questions of all runs that the reader may see, the oldest first.
     */
    Waiting: {
        questions: RunnerApi["WaitingQuestion"][];
    };
    /**
     * WaitingQuestion
     * @description An open question of any run. `may`: the reader may answer it; else `why` says why not.
     */
    WaitingQuestion: {
        run: string;
        number: number;
        graph: string | null;
        graph_name: string;
        simulated: boolean;
        question: RunnerApi["QuestionShown"];
        may: boolean;
        /** @default  */
        why?: string;
    };
    /**
     * WaitingShown
     * @description The reason why an entry waits for one robot, in words. `run`: the id of the run that goes on there.
     */
    WaitingShown: {
        robot: string;
        /** @enum {string} */
        why: "behind" | "closed" | "run" | "stop";
        text: string;
        run: string | null;
    };
    /**
     * Where
     * @description The place of a problem or note. `path` is a JSON pointer into the text that was given, or
     *     into the canonical text of a graph that was not read from a text.
     *
     *     `line` and `column` (in characters, both from 1) are present if that text is known: the value
     *     begins there, with its key if it has one.
     */
    Where: {
        /** @default  */
        path?: string;
        aid?: string;
        relation?: string;
        line?: number;
        column?: number;
    };
    /**
     * WordRequest
     * @description The outcome of an action in a led run by the word of a person, with the reason. `action`:
     *     its full name; `piece`: the run of its piece that the person has seen, so that the word counts for
     *     no later visit; `request_id`: as in `GoOnRequest`.
     */
    WordRequest: {
        action: string;
        /** @enum {string} */
        outcome: "error" | "false" | "true";
        reason: string;
        /** @default  */
        piece?: string;
        /** @default  */
        request_id?: string;
    };
    /**
     * WritableGraph
     * @description A graph that can be written. `replaces`: the path, in the folder, of the file that it would
     *     replace; "" for none.
     */
    WritableGraph: {
        graph: string;
        replaces: string;
    };
    /**
     * WrittenFile
     * @description A file that was written. `kept`: the path to which the file that it replaced was moved, ""
     *     for none.
     */
    WrittenFile: {
        graph: string;
        path: string;
        /** @default  */
        kept?: string;
    };
}

export interface RunnerPaths {
    "/api/runs": {
        get: RunnerOperations["listRuns"];
        post: RunnerOperations["startRun"];
    };
    "/api/starts/{request_id}": {
        get: RunnerOperations["getStart"];
    };
    "/api/stop": {
        post: RunnerOperations["stopAll"];
    };
    "/api/runs/{run}/stop": {
        post: RunnerOperations["stopRun"];
    };
    "/api/runs/{run}/pause": {
        post: RunnerOperations["pauseRun"];
    };
    "/api/runs/{run}/resume": {
        post: RunnerOperations["resumeRun"];
    };
    "/api/runs/{run}/modify": {
        post: RunnerOperations["modifyRun"];
    };
    "/api/runs/{run}/at_rest": {
        post: RunnerOperations["confirmRest"];
    };
    "/api/runs/{run}/go_on": {
        post: RunnerOperations["goOn"];
    };
    "/api/runs/{run}/step": {
        post: RunnerOperations["stepRun"];
    };
    "/api/runs/{run}/wait": {
        post: RunnerOperations["waitRun"];
    };
    "/api/runs/{run}/breakpoints": {
        put: RunnerOperations["setBreakpoints"];
    };
    "/api/runs/{run}/outcome": {
        post: RunnerOperations["giveOutcome"];
    };
    "/api/questions": {
        get: RunnerOperations["waitingQuestions"];
    };
    "/api/runs/{run}/questions": {
        get: RunnerOperations["runQuestions"];
    };
    "/api/runs/{run}/questions/{question}/answer": {
        post: RunnerOperations["answerQuestion"];
    };
    "/api/runs/{run}/questions/{question}/photo": {
        post: RunnerOperations["sendPhoto"];
    };
    "/api/runs/{run}/photos/{photo}": {
        get: RunnerOperations["runPhoto"];
    };
    "/api/repeats": {
        get: RunnerOperations["listRepeats"];
        post: RunnerOperations["openRepeat"];
    };
    "/api/repeats/{repeat}": {
        get: RunnerOperations["getRepeat"];
    };
    "/api/repeats/{repeat}/table": {
        get: RunnerOperations["exportRepeat"];
    };
    "/api/repeats/{repeat}/look": {
        post: RunnerOperations["lookAtCell"];
    };
    "/api/repeats/{repeat}/start": {
        post: RunnerOperations["startCell"];
    };
    "/api/repeats/{repeat}/close": {
        post: RunnerOperations["closeRepeat"];
    };
    "/api/repeats/{repeat}/open": {
        post: RunnerOperations["reopenRepeat"];
    };
    "/api/queue": {
        get: RunnerOperations["getQueue"];
        post: RunnerOperations["enterQueue"];
    };
    "/api/queue/{entry}/look": {
        post: RunnerOperations["lookAtEntry"];
    };
    "/api/queue/{entry}/start": {
        post: RunnerOperations["startEntry"];
    };
    "/api/queue/{entry}/move": {
        post: RunnerOperations["moveEntry"];
    };
    "/api/queue/{entry}/remove": {
        post: RunnerOperations["removeEntry"];
    };
    "/api/queue/robots/{name}/close": {
        post: RunnerOperations["closeQueue"];
    };
    "/api/queue/robots/{name}/open": {
        post: RunnerOperations["openQueue"];
    };
    "/api/labels": {
        get: RunnerOperations["listLabels"];
    };
    "/api/runs/{run}": {
        get: RunnerOperations["getRun"];
    };
    "/api/runs/{run}/events": {
        get: RunnerOperations["followRun"];
    };
    "/api/approvals": {
        get: RunnerOperations["listApprovals"];
        post: RunnerOperations["approve"];
    };
    "/api/approvals/asked": {
        get: RunnerOperations["listAskedApprovals"];
        post: RunnerOperations["askApproval"];
    };
    "/api/robots": {
        get: RunnerOperations["listRobots"];
        post: RunnerOperations["registerRobot"];
    };
    "/api/reach": {
        get: RunnerOperations["getReach"];
    };
    "/api/candidates": {
        get: RunnerOperations["findEngines"];
    };
    "/api/candidates/now": {
        get: RunnerOperations["getFoundEngines"];
    };
    "/api/practice": {
        post: RunnerOperations["startPracticeRobot"];
    };
    "/api/robots/{name}": {
        get: RunnerOperations["getRobot"];
        delete: RunnerOperations["forgetRobot"];
        patch: RunnerOperations["changeRobot"];
    };
    "/api/robots/{name}/known": {
        get: RunnerOperations["getRobotIndex"];
    };
    "/api/robots/{name}/known/{action}": {
        get: RunnerOperations["getIndexedAction"];
    };
    "/api/robots/{name}/events": {
        get: RunnerOperations["getRobotLog"];
    };
    "/api/robots/{name}/events/{seq}/umrf": {
        get: RunnerOperations["getCommandedGraph"];
    };
    "/api/robots/{name}/umrf": {
        get: RunnerOperations["getHeldGraph"];
    };
    "/api/robots/{name}/recordings": {
        get: RunnerOperations["listRecordings"];
    };
    "/api/robots/{name}/recordings/{file}": {
        get: RunnerOperations["downloadRecording"];
    };
    "/api/robots/{name}/stop": {
        post: RunnerOperations["stopRobot"];
    };
    "/api/preflight": {
        post: RunnerOperations["runPreflight"];
    };
    "/api/asked_inputs": {
        post: RunnerOperations["findAskedInputs"];
    };
    "/api/groups": {
        post: RunnerOperations["startGroup"];
    };
    "/api/robots/{name}/index": {
        post: RunnerOperations["writeIntoIndex"];
    };
    "/api/robots/{name}/rights": {
        put: RunnerOperations["setRobotRights"];
    };
    "/api/rights": {
        get: RunnerOperations["getRights"];
    };
    "/api/robots/{name}/baton/take": {
        post: RunnerOperations["takeBaton"];
    };
    "/api/robots/{name}/baton/hand": {
        post: RunnerOperations["handBaton"];
    };
    "/api/robots/{name}/baton/drop": {
        post: RunnerOperations["dropBaton"];
    };
    "/api/runs/{run}/hand_over": {
        post: RunnerOperations["handOverRun"];
    };
    "/api/robots/{name}/lock": {
        post: RunnerOperations["lockRobot"];
    };
    "/api/robots/{name}/unlock": {
        post: RunnerOperations["unlockRobot"];
    };
    "/api/robots/{name}/drills": {
        get: RunnerOperations["listDrills"];
        post: RunnerOperations["recordDrill"];
    };
    "/api/releases/{version}": {
        put: RunnerOperations["storeRelease"];
        delete: RunnerOperations["dropRelease"];
    };
    "/api/expectations": {
        get: RunnerOperations["listExpectations"];
        post: RunnerOperations["addExpectation"];
    };
    "/api/expectations/{name}": {
        delete: RunnerOperations["retireExpectation"];
    };
    "/api/expectations/check": {
        post: RunnerOperations["checkExpectations"];
    };
    "/api/expectations/proposal": {
        post: RunnerOperations["proposeCourse"];
    };
    "/api/runs/{run}/film": {
        get: RunnerOperations["getReplay"];
    };
    "/api/runs/{run}/causes": {
        get: RunnerOperations["listCauses"];
    };
    "/api/runs/{run}/umrf": {
        get: RunnerOperations["getRunUmrf"];
    };
    "/api/runs/{run}/marks": {
        get: RunnerOperations["getMarks"];
        patch: RunnerOperations["setMarks"];
    };
    "/api/runs/{run}/notes": {
        get: RunnerOperations["listRunNotes"];
        post: RunnerOperations["addRunNote"];
    };
    "/api/runs/{run}/script": {
        get: RunnerOperations["getScript"];
        post: RunnerOperations["makeScript"];
    };
    "/api/runs/{run}/export": {
        get: RunnerOperations["exportRun"];
    };
    "/api/runs/{run}/raw": {
        get: RunnerOperations["getRawMessages"];
    };
    "/api/runs/{run}/incident": {
        post: RunnerOperations["keepIncident"];
    };
    "/api/comparison": {
        get: RunnerOperations["compareRuns"];
    };
    "/api/statistics": {
        get: RunnerOperations["getStatistics"];
    };
    "/api/examples": {
        post: RunnerOperations["importExamples"];
    };
    "/api/archive": {
        post: RunnerOperations["archiveRuns"];
    };
    "/api/audit": {
        get: RunnerOperations["listAudit"];
    };
    "/api/graph-rules": {
        put: RunnerOperations["storeGraphRules"];
    };
    "/api/view/run": {
        get: RunnerOperations["viewRun"];
    };
    "/api/view/run/events": {
        get: RunnerOperations["followViewedRun"];
    };
    "/api/view-links": {
        get: RunnerOperations["listViewLinks"];
        post: RunnerOperations["makeViewLink"];
    };
    "/api/view-links/{link}/revoke": {
        post: RunnerOperations["revokeViewLink"];
    };
    "/api/members/{person}": {
        put: RunnerOperations["storeMember"];
    };
    "/api/revocations": {
        post: RunnerOperations["revokeSessions"];
    };
    "/api/session": {
        delete: RunnerOperations["signOut"];
    };
    "/api/sessions/ended": {
        post: RunnerOperations["tellEndedSession"];
    };
    "/api/tokens": {
        get: RunnerOperations["listTokens"];
    };
    "/api/tokens/{token}/revoke": {
        post: RunnerOperations["revokeToken"];
    };
    "/api/notifications": {
        get: RunnerOperations["listReceivers"];
    };
    "/api/notifications/{name}/test": {
        post: RunnerOperations["testReceiver"];
    };
    "/api/tokens/records": {
        post: RunnerOperations["adoptToken"];
    };
    "/api/confirmations/mine": {
        get: RunnerOperations["getConfirmation"];
    };
    "/api/confirmations/records": {
        post: RunnerOperations["adoptConfirmation"];
    };
    "/api/confirmations": {
        post: RunnerOperations["askToConfirm"];
    };
    "/api/confirmations/{request_id}": {
        get: RunnerOperations["getConfirmationRequest"];
        delete: RunnerOperations["cancelConfirmationRequest"];
    };
    "/api/confirmations/{request_id}/answer": {
        post: RunnerOperations["answerConfirmationRequest"];
    };
    "/healthz": {
        get: RunnerOperations["getHealth"];
    };
    "/readyz": {
        get: RunnerOperations["getReadiness"];
    };
    "/metrics": {
        get: RunnerOperations["getMetrics"];
    };
    "/api/status": {
        get: RunnerOperations["getStatus"];
    };
    "/api/server": {
        get: RunnerOperations["proveServer"];
    };
}

interface RunnerOperations {
    listRuns: {
        parameters: {
            query?: {
                graph?: string | null;
                robot?: string | null;
                state?: string | null;
                failed?: boolean | null;
                version?: string | null;
                person?: string | null;
                text?: string | null;
                label?: string | null;
                pinned?: boolean | null;
                since?: string | null;
                until?: string | null;
                before?: string | null;
                limit?: number;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Listed"][];
                };
            };
        };
    };
    startRun: {
        requestBody: {
            content: {
                "application/json": RunnerApi["StartRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RunShown"];
                };
            };
            201: {
                content: {
                    "application/json": RunnerApi["RunShown"];
                };
            };
        };
    };
    getStart: {
        parameters: {
            path: {
                request_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["StartShown"];
                };
            };
        };
    };
    stopAll: {
        requestBody?: {
            content: {
                "application/json": RunnerApi["StopBody"];
            };
        };
        responses: {
            202: {
                content: {
                    "application/json": RunnerApi["Stopping"];
                };
            };
        };
    };
    stopRun: {
        parameters: {
            path: {
                run: string;
            };
        };
        requestBody?: {
            content: {
                "application/json": RunnerApi["StopBody"];
            };
        };
        responses: {
            202: {
                content: {
                    "application/json": RunnerApi["Stopping"];
                };
            };
        };
    };
    pauseRun: {
        parameters: {
            path: {
                run: string;
            };
        };
        responses: {
            202: {
                content: {
                    "application/json": RunnerApi["RunShown"];
                };
            };
        };
    };
    resumeRun: {
        parameters: {
            path: {
                run: string;
            };
        };
        requestBody?: {
            content: {
                "application/json": RunnerApi["ResumeRequest"];
            };
        };
        responses: {
            202: {
                content: {
                    "application/json": RunnerApi["RunShown"];
                };
            };
        };
    };
    modifyRun: {
        parameters: {
            path: {
                run: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["ModifyRequest"];
            };
        };
        responses: {
            202: {
                content: {
                    "application/json": RunnerApi["RunShown"];
                };
            };
        };
    };
    confirmRest: {
        parameters: {
            path: {
                run: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["RestRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RunShown"];
                };
            };
        };
    };
    goOn: {
        parameters: {
            path: {
                run: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["GoOnRequest"];
            };
        };
        responses: {
            202: {
                content: {
                    "application/json": RunnerApi["RunShown"];
                };
            };
        };
    };
    stepRun: {
        parameters: {
            path: {
                run: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["StepRequest"];
            };
        };
        responses: {
            202: {
                content: {
                    "application/json": RunnerApi["RunShown"];
                };
            };
        };
    };
    waitRun: {
        parameters: {
            path: {
                run: string;
            };
        };
        requestBody?: {
            content: {
                "application/json": RunnerApi["WaitRequest"];
            };
        };
        responses: {
            202: {
                content: {
                    "application/json": RunnerApi["RunShown"];
                };
            };
        };
    };
    setBreakpoints: {
        parameters: {
            path: {
                run: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["BreakpointsRequest"];
            };
        };
        responses: {
            202: {
                content: {
                    "application/json": RunnerApi["RunShown"];
                };
            };
        };
    };
    giveOutcome: {
        parameters: {
            path: {
                run: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["WordRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RunShown"];
                };
            };
        };
    };
    waitingQuestions: {
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Waiting"];
                };
            };
        };
    };
    runQuestions: {
        parameters: {
            path: {
                run: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["QuestionsShown"];
                };
            };
        };
    };
    answerQuestion: {
        parameters: {
            path: {
                run: string;
                question: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["AnswerRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RunShown"];
                };
            };
        };
    };
    sendPhoto: {
        parameters: {
            path: {
                run: string;
                question: string;
            };
        };
        requestBody: {
            content: {
                "application/json": string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["PhotoStored"];
                };
            };
        };
    };
    runPhoto: {
        parameters: {
            path: {
                run: string;
                photo: string;
            };
        };
        responses: {
            200: {
                content: {
                    "image/*": string;
                };
            };
        };
    };
    listRepeats: {
        parameters: {
            query?: {
                graph?: string | null;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RepeatSummary"][];
                };
            };
        };
    };
    openRepeat: {
        requestBody: {
            content: {
                "application/json": RunnerApi["RepeatRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RepeatShown"];
                };
            };
            201: {
                content: {
                    "application/json": RunnerApi["RepeatShown"];
                };
            };
        };
    };
    getRepeat: {
        parameters: {
            path: {
                repeat: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RepeatShown"];
                };
            };
        };
    };
    exportRepeat: {
        parameters: {
            query?: {
                format?: "csv" | "parquet";
            };
            path: {
                repeat: string;
            };
        };
        responses: {
            200: {
                content: {
                    "text/csv": string;
                };
            };
        };
    };
    lookAtCell: {
        parameters: {
            path: {
                repeat: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["CellLookRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Preflight"][];
                };
            };
        };
    };
    startCell: {
        parameters: {
            path: {
                repeat: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["NextRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RunShown"];
                };
            };
            201: {
                content: {
                    "application/json": RunnerApi["RunShown"];
                };
            };
        };
    };
    closeRepeat: {
        parameters: {
            path: {
                repeat: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RepeatShown"];
                };
            };
        };
    };
    reopenRepeat: {
        parameters: {
            path: {
                repeat: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["ReopenRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RepeatShown"];
                };
            };
        };
    };
    getQueue: {
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["QueueShown"];
                };
            };
        };
    };
    enterQueue: {
        requestBody: {
            content: {
                "application/json": RunnerApi["QueueRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["QueueShown"];
                };
            };
            201: {
                content: {
                    "application/json": RunnerApi["QueueShown"];
                };
            };
        };
    };
    lookAtEntry: {
        parameters: {
            path: {
                entry: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["LookRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["LookShown"];
                };
            };
        };
    };
    startEntry: {
        parameters: {
            path: {
                entry: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["TurnRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["EntryStarted"];
                };
            };
            201: {
                content: {
                    "application/json": RunnerApi["EntryStarted"];
                };
            };
        };
    };
    moveEntry: {
        parameters: {
            path: {
                entry: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["MoveRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["QueueShown"];
                };
            };
        };
    };
    removeEntry: {
        parameters: {
            path: {
                entry: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["QueueShown"];
                };
            };
        };
    };
    closeQueue: {
        parameters: {
            path: {
                name: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["QueueShown"];
                };
            };
        };
    };
    openQueue: {
        parameters: {
            path: {
                name: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["OpenQueueRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["QueueShown"];
                };
            };
        };
    };
    listLabels: {
        responses: {
            200: {
                content: {
                    "application/json": string[];
                };
            };
        };
    };
    getRun: {
        parameters: {
            path: {
                run: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RunWhole"];
                };
            };
        };
    };
    followRun: {
        parameters: {
            path: {
                run: string;
            };
        };
        responses: {
            200: {
                content: {
                    "text/event-stream": RunnerApi["HistoryEvent"];
                };
            };
            204: {
            };
        };
    };
    listApprovals: {
        parameters: {
            query: {
                digest: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Approval"][];
                };
            };
        };
    };
    approve: {
        requestBody: {
            content: {
                "application/json": RunnerApi["ApprovalRequest"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": RunnerApi["Approval"];
                };
            };
        };
    };
    listAskedApprovals: {
        parameters: {
            query: {
                graph: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["ApprovalWanted"][];
                };
            };
        };
    };
    askApproval: {
        requestBody: {
            content: {
                "application/json": RunnerApi["ApprovalQuestion"];
            };
        };
        responses: {
            202: {
                content: {
                    "application/json": RunnerApi["AskedOthers"];
                };
            };
        };
    };
    listRobots: {
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Robot"][];
                };
            };
        };
    };
    registerRobot: {
        requestBody: {
            content: {
                "application/json": RunnerApi["Registration"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": RunnerApi["Robot"];
                };
            };
        };
    };
    getReach: {
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["ReachStatus"];
                };
            };
        };
    };
    findEngines: {
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Candidate"][];
                };
            };
        };
    };
    getFoundEngines: {
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Sighting"];
                };
            };
        };
    };
    startPracticeRobot: {
        responses: {
            201: {
                content: {
                    "application/json": RunnerApi["Robot"];
                };
            };
        };
    };
    getRobot: {
        parameters: {
            path: {
                name: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Robot"];
                };
            };
        };
    };
    forgetRobot: {
        parameters: {
            path: {
                name: string;
            };
        };
        responses: {
            204: {
            };
        };
    };
    changeRobot: {
        parameters: {
            path: {
                name: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["RobotChange"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Robot"];
                };
            };
        };
    };
    getRobotIndex: {
        parameters: {
            path: {
                name: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RobotKnowledge"];
                };
            };
        };
    };
    getIndexedAction: {
        parameters: {
            path: {
                name: string;
                action: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": {
                        [key: string]: unknown;
                    };
                };
            };
        };
    };
    getRobotLog: {
        parameters: {
            path: {
                name: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RobotLogLine"][];
                };
            };
        };
    };
    getCommandedGraph: {
        parameters: {
            path: {
                name: string;
                seq: number;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": {
                        [key: string]: unknown;
                    };
                };
            };
        };
    };
    getHeldGraph: {
        parameters: {
            query: {
                graph: string;
            };
            path: {
                name: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": {
                        [key: string]: unknown;
                    };
                };
            };
        };
    };
    listRecordings: {
        parameters: {
            path: {
                name: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Recording"][];
                };
            };
        };
    };
    downloadRecording: {
        parameters: {
            path: {
                name: string;
                file: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/gzip": string;
                };
            };
        };
    };
    stopRobot: {
        parameters: {
            path: {
                name: string;
            };
        };
        responses: {
            202: {
                content: {
                    "application/json": RunnerApi["RobotStopped"];
                };
            };
        };
    };
    runPreflight: {
        requestBody: {
            content: {
                "application/json": RunnerApi["GroupRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Preflight"][];
                };
            };
        };
    };
    findAskedInputs: {
        requestBody: {
            content: {
                "application/json": RunnerApi["AskedInputsRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["AskedInput"][];
                };
            };
        };
    };
    startGroup: {
        requestBody: {
            content: {
                "application/json": RunnerApi["GroupRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["GroupShown"];
                };
            };
            201: {
                content: {
                    "application/json": RunnerApi["GroupShown"];
                };
            };
        };
    };
    writeIntoIndex: {
        parameters: {
            path: {
                name: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["IndexWriteRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["IndexWriteAnswer"];
                };
            };
        };
    };
    setRobotRights: {
        parameters: {
            path: {
                name: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["RightsWanted"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Robot"];
                };
            };
        };
    };
    getRights: {
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RightsShown"];
                };
            };
        };
    };
    takeBaton: {
        parameters: {
            path: {
                name: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["BatonTake"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Robot"];
                };
            };
        };
    };
    handBaton: {
        parameters: {
            path: {
                name: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["BatonHand"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Robot"];
                };
            };
        };
    };
    dropBaton: {
        parameters: {
            path: {
                name: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Robot"];
                };
            };
        };
    };
    handOverRun: {
        parameters: {
            path: {
                run: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["BatonHand"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RunShown"];
                };
            };
        };
    };
    lockRobot: {
        parameters: {
            path: {
                name: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["LockWanted"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Robot"];
                };
            };
        };
    };
    unlockRobot: {
        parameters: {
            path: {
                name: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["UnlockWanted"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Robot"];
                };
            };
        };
    };
    listDrills: {
        parameters: {
            path: {
                name: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["DrillShown"][];
                };
            };
        };
    };
    recordDrill: {
        parameters: {
            path: {
                name: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["DrillRequest"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": RunnerApi["Robot"];
                };
            };
        };
    };
    storeRelease: {
        parameters: {
            path: {
                version: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["Release"];
            };
        };
        responses: {
            204: {
            };
        };
    };
    dropRelease: {
        parameters: {
            path: {
                version: string;
            };
        };
        responses: {
            204: {
            };
        };
    };
    listExpectations: {
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Expectation"][];
                };
            };
        };
    };
    addExpectation: {
        requestBody: {
            content: {
                "application/json": RunnerApi["Expect"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": RunnerApi["Expectation"];
                };
            };
        };
    };
    retireExpectation: {
        parameters: {
            path: {
                name: string;
            };
        };
        responses: {
            204: {
            };
        };
    };
    checkExpectations: {
        requestBody: {
            content: {
                "application/json": RunnerApi["CheckRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["CheckedCourses"];
                };
            };
        };
    };
    proposeCourse: {
        requestBody: {
            content: {
                "application/json": RunnerApi["ProposalRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["ArrowProposal"];
                };
            };
        };
    };
    getReplay: {
        parameters: {
            query?: {
                after?: number;
            };
            path: {
                run: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RunReplay"];
                };
            };
        };
    };
    listCauses: {
        parameters: {
            path: {
                run: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["CauseShown"][];
                };
            };
        };
    };
    getRunUmrf: {
        parameters: {
            path: {
                run: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": {
                        [key: string]: unknown;
                    };
                };
            };
        };
    };
    getMarks: {
        parameters: {
            path: {
                run: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RunMarks"];
                };
            };
        };
    };
    setMarks: {
        parameters: {
            path: {
                run: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["Marks"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RunMarks"];
                };
            };
        };
    };
    listRunNotes: {
        parameters: {
            path: {
                run: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RunNote"][];
                };
            };
        };
    };
    addRunNote: {
        parameters: {
            path: {
                run: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["NoteText"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": RunnerApi["RunNote"][];
                };
            };
        };
    };
    getScript: {
        parameters: {
            query?: {
                action?: string | null;
                fault?: "error" | "false" | "hang" | "init_error" | null;
            };
            path: {
                run: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Recorded"];
                };
            };
        };
    };
    makeScript: {
        parameters: {
            path: {
                run: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["ScriptRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Recorded"];
                };
            };
        };
    };
    exportRun: {
        parameters: {
            query: {
                format: "jsonl" | "csv" | "mcap";
            };
            path: {
                run: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/octet-stream": string;
                };
            };
        };
    };
    getRawMessages: {
        parameters: {
            path: {
                run: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RawMessages"];
                };
            };
        };
    };
    keepIncident: {
        parameters: {
            path: {
                run: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["IncidentRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/zip": string;
                };
            };
        };
    };
    compareRuns: {
        parameters: {
            query: {
                a: string;
                b: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["RunComparison"];
                };
            };
        };
    };
    getStatistics: {
        parameters: {
            query: {
                graph: string;
                robot?: string | null;
                last?: number;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Statistics"];
                };
            };
        };
    };
    importExamples: {
        responses: {
            200: {
                content: {
                    "application/json": string[];
                };
            };
        };
    };
    archiveRuns: {
        requestBody: {
            content: {
                "application/json": RunnerApi["ArchiveRequest"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["SweepResult"];
                };
            };
        };
    };
    listAudit: {
        parameters: {
            query?: {
                before?: number | null;
                limit?: number;
                person?: string;
                robot?: string;
                graph?: string;
                kind?: string;
                since?: string | null;
                until?: string | null;
                text?: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["AuditPage"];
                };
            };
        };
    };
    storeGraphRules: {
        requestBody: {
            content: {
                "application/json": RunnerApi["Statement"];
            };
        };
        responses: {
            204: {
            };
        };
    };
    viewRun: {
        parameters: {
            query?: {
                again?: boolean;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["SharedRun"];
                };
            };
        };
    };
    followViewedRun: {
        responses: {
            200: {
                content: {
                    "text/event-stream": RunnerApi["SharedStateMessage"] | RunnerApi["SharedBeat"];
                };
            };
        };
    };
    listViewLinks: {
        parameters: {
            query?: {
                thing?: string | null;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["ViewLink"][];
                };
            };
        };
    };
    makeViewLink: {
        requestBody: {
            content: {
                "application/json": RunnerApi["NewViewLink"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": RunnerApi["ViewLink"];
                };
            };
        };
    };
    revokeViewLink: {
        parameters: {
            path: {
                link: string;
            };
        };
        responses: {
            204: {
            };
        };
    };
    storeMember: {
        parameters: {
            path: {
                person: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["PersonFile"];
            };
        };
        responses: {
            204: {
            };
        };
    };
    revokeSessions: {
        requestBody: {
            content: {
                "application/json": RunnerApi["Revocation"];
            };
        };
        responses: {
            204: {
            };
        };
    };
    signOut: {
        responses: {
            204: {
            };
        };
    };
    tellEndedSession: {
        requestBody: {
            content: {
                "application/json": RunnerApi["SessionEnd"];
            };
        };
        responses: {
            204: {
            };
        };
    };
    listTokens: {
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["TokenList"];
                };
            };
        };
    };
    revokeToken: {
        parameters: {
            path: {
                token: string;
            };
        };
        responses: {
            204: {
            };
        };
    };
    listReceivers: {
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["ReceiverState"][];
                };
            };
        };
    };
    testReceiver: {
        parameters: {
            path: {
                name: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["ReceiverState"];
                };
            };
        };
    };
    adoptToken: {
        requestBody: {
            content: {
                "application/json": RunnerApi["Adopted"];
            };
        };
        responses: {
            204: {
            };
        };
    };
    getConfirmation: {
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["OwnConfirmation"];
                };
            };
        };
    };
    adoptConfirmation: {
        requestBody: {
            content: {
                "application/json": RunnerApi["Confirmation"];
            };
        };
        responses: {
            204: {
            };
        };
    };
    askToConfirm: {
        requestBody: {
            content: {
                "application/json": RunnerApi["ConfirmationWanted"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": RunnerApi["ConfirmationAsked"];
                };
            };
        };
    };
    getConfirmationRequest: {
        parameters: {
            path: {
                request_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["ConfirmationAsked"];
                };
            };
        };
    };
    cancelConfirmationRequest: {
        parameters: {
            path: {
                request_id: string;
            };
        };
        responses: {
            204: {
            };
        };
    };
    answerConfirmationRequest: {
        parameters: {
            path: {
                request_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": RunnerApi["ConfirmationAnswer"];
            };
        };
        responses: {
            204: {
            };
        };
    };
    getHealth: {
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Health"];
                };
            };
        };
    };
    getReadiness: {
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["Readiness"];
                };
            };
        };
    };
    getMetrics: {
        responses: {
            200: {
                content: {
                    "text/plain": string;
                };
            };
        };
    };
    getStatus: {
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["ProcessStatus"];
                };
            };
        };
    };
    proveServer: {
        parameters: {
            query: {
                challenge: string;
                token?: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": RunnerApi["ServerProof"];
                };
            };
        };
    };
}
