/** What the editor takes and answers. Made by `make types`; changes are lost. */
export interface EditorApi {
    /**
     * ActionBuilt
     * @description A build of the package of an action was reported; `at` is when it ended.
     */
    ActionBuilt: {
        package: string;
        ended_well: boolean;
        /** Format: date-time */
        at: string;
        errors: EditorApi["BuildFault"][];
    };
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
        fields: EditorApi["Field"][];
    };
    /**
     * ActionUse
     * @description A graph that uses an action of the library. `seq`: its change that was examined; `count`: how
     *     many of its actions are uses.
     *
     *     `changed`: an update would change the graph. `difference`: what the update would change.
     *     `suggested`: likely renames, which are not in it unless requested.
     */
    ActionUse: {
        graph: string;
        name: string;
        seq: number;
        count: number;
        changed: boolean;
        difference: EditorApi["Difference"] | null;
        suggested: EditorApi["Renames"];
    };
    /**
     * ActionUses
     * @description The graphs that use an action, and how updating them to its change `seq` would change them.
     */
    ActionUses: {
        seq: number;
        uses: EditorApi["ActionUse"][];
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
        robots: EditorApi["RobotLink"][];
    };
    /**
     * Answering
     * @description An answer, yes or no, to a proposal by a person who has seen the draft after its change
     *     `seq`.
     */
    Answering: {
        yes: boolean;
        seq: number;
        /** @default  */
        note?: string;
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
     * AskedMerge
     * @description The side that the other side's changes are merged into, and, by the place of a conflict, the
     *     side whose value is chosen.
     */
    AskedMerge: {
        /**
         * @default origin
         * @enum {string}
         */
        into?: "draft" | "origin";
        /** @default {} */
        choices?: {
            [key: string]: "draft" | "origin";
        };
    };
    /**
     * AskingSince
     * @description The request: search between the change `good` and the change `bad` (missing: the newest).
     *     `script`: what the actions do, as in a script of `simulate`, the same for every change.
     *     `named_at`: the change after which actions had the names in `script` (missing: `bad`).
     */
    AskingSince: {
        good: number;
        script: EditorApi["Script"];
        /** @default null */
        bad?: number | null;
        /** @default null */
        named_at?: number | null;
    };
    /**
     * AuditPage
     * @description Rows, the newest first. `before`: the cursor of the next page; null once the begin of the log is
     *     reached. A page may be empty and have a cursor, since one answer looks at a part of the log.
     *     `back_to`: the time of the oldest event that was looked at; `dropped`: the newest rows that were
     *     dropped because of their age; null if none were.
     */
    AuditPage: {
        rows: EditorApi["AuditRow"][];
        before: number | null;
        back_to: string | null;
        dropped: EditorApi["DroppedRows"] | null;
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
        person?: EditorApi["PersonRef"];
        from?: EditorApi["Origin"];
        /** @default  */
        graph?: string;
        /** @default  */
        graph_name?: string;
        seq?: number;
        /** @default  */
        run?: string;
        run_number?: number;
        /** @default [] */
        robots?: string[];
        /** @default 1 */
        times?: number;
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
     * BeginLogin
     * @description The request of a program for a token that a person confirms.
     */
    BeginLogin: {
        name: string;
        scopes: ("edit" | "hooks" | "operate" | "read" | "scrape" | "simulate")[];
        /** @default null */
        days?: number | null;
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
        value?: EditorApi["ValueTest"];
        /** @default  */
        inside?: string;
    };
    /**
     * BuildFault
     * @description An error of a compiler or of CMake. `file` is below the package, "" where none was named; `line`
     *     and `column` are from 1.
     */
    BuildFault: {
        message: string;
        file: string;
        line: number | null;
        column: number | null;
    };
    /**
     * BuildReport
     * @description The result of the last build of an action's package; `at` is when the build ended.
     */
    BuildReport: {
        package: string;
        ended_well: boolean;
        /** Format: date-time */
        at: string;
        errors: EditorApi["BuildFault"][];
    };
    /**
     * ByProvider
     * @description The provider by which a person signs in, and the role that its groups give there: owners may
     *     give a lower one.
     */
    ByProvider: {
        issuer: string;
        /** @enum {string} */
        role: "editor" | "operator" | "owner" | "viewer";
    };
    /**
     * CalledUses
     * @description The graphs in which actions were renamed, each by one edit; and those in which that failed
     *     after others were changed.
     */
    CalledUses: {
        changed: string[];
        /** @default [] */
        refused?: EditorApi["RefusedUse"][];
    };
    /**
     * CallingUses
     * @description A request to rename the actions called `before` in `graphs` to `name`, after the graph that
     *     they stand for was renamed.
     */
    CallingUses: {
        before: string;
        name: string;
        graphs: string[];
    };
    /**
     * ChangedThings
     * @description A difference with at most 30 items of each kind; `more`: the number of others.
     */
    ChangedThings: {
        /** @default [] */
        fields?: EditorApi["Field"][];
        /** @default [] */
        actions?: EditorApi["ActionChange"][];
        /** @default [] */
        relations?: EditorApi["RelationChange"][];
        /** @default [] */
        notes?: EditorApi["NoteChange"][];
        /** @default 0 */
        more?: number;
    };
    /**
     * Changes
     * @description The changes of one person. `comments`: the number of threads with new comments.
     *     `overwritten`: the values that this person set while another, without knowing of it, set the
     *     values that stayed: each as the difference between what this person wanted (`before`) and what
     *     stayed (`after`). Of notes the text that this person wanted.
     */
    Changes: {
        /** @default [] */
        fields?: EditorApi["Field"][];
        /** @default [] */
        actions?: EditorApi["ActionChange"][];
        /** @default [] */
        relations?: EditorApi["RelationChange"][];
        /** @default [] */
        notes?: EditorApi["NoteChange"][];
        /** @default 0 */
        more?: number;
        /** @default 0 */
        comments?: number;
        overwritten?: EditorApi["ChangedThings"];
    };
    /**
     * ClaimOfDevice
     * @description The claim of a browser that waits to be confirmed.
     */
    ClaimOfDevice: {
        claim: string;
    };
    /**
     * Claimed
     * @description The answer to a program that waits. `slower`: it asked too early, and waits `interval` seconds
     *     from now on. `gone`: the code has expired, was cancelled, or was used already.
     */
    Claimed: {
        /** @enum {string} */
        state: "gone" | "granted" | "refused" | "slower" | "waiting";
        /** @default 2 */
        interval?: number;
        made?: EditorApi["MadeToken"];
    };
    /**
     * CodeOfDevice
     * @description The code that a browser of the person shows, typed in on another one.
     */
    CodeOfDevice: {
        code: string;
    };
    /**
     * Command
     * @description A command of a person to the running graph, and its time.
     */
    Command: {
        at_ms: number;
        /** @enum {string} */
        verb: "pause" | "resume" | "stop";
    };
    /**
     * Config
     * @description The settings that a page asks for first. `runner_url` has no slash at its end. `commit`: the commit of
     *     this program, null where it is unknown. `run_links`: from runs to what other programs recorded of them.
     *     `runners`: all of them, if there are several; the first is at `runner_url`.
     */
    Config: {
        mode: string;
        version: string;
        runner_url: string;
        commit: string | null;
        run_links: EditorApi["RunLink"][];
        runners?: EditorApi["Site"][];
    };
    /**
     * ConfirmLogin
     * @description The word of a person for a login: the name and the scopes, which are among those that the
     *     program asked for.
     */
    ConfirmLogin: {
        name: string;
        scopes: ("edit" | "hooks" | "operate" | "read" | "scrape" | "simulate")[];
        /** @default null */
        days?: number | null;
        code: string;
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
     * Counts
     * @description The number of problems of each severity.
     */
    Counts: {
        error: number;
        warning: number;
    };
    /**
     * CourseChange
     * @description From the change `seq` on the course differs from the first one (`parts`), or equals it again.
     *     `place`, `before`, `after`: the first step, from 1, in which the courses before and after
     *     this change differ, and that step in each, in words. `changes`: the effect of the change on
     *     the graph.
     */
    CourseChange: {
        seq: number;
        author: EditorApi["PersonRef"];
        /** Format: date-time */
        at: string;
        parts: boolean;
        place: number;
        before: string;
        after: string;
        changes: EditorApi["Changes"];
    };
    /**
     * Describing
     * @description A new name or description of a graph. A missing field does not change.
     */
    Describing: {
        /** @default null */
        name?: string | null;
        /** @default null */
        description?: string | null;
    };
    /**
     * DeviceAnswer
     * @description The answer to a browser that waits: the session, or nothing while nobody has confirmed it.
     */
    DeviceAnswer: {
        signed_in?: EditorApi["SignedIn"];
    };
    /**
     * DeviceAsking
     * @description The other browser, as the first one sees it. `browser` is missing while no browser has sent
     *     the code; `number` is shown on both.
     */
    DeviceAsking: {
        id: string;
        /** @default  */
        browser?: string;
        /** @default  */
        address?: string;
        /** @default  */
        number?: string;
        /** @default false */
        answered?: boolean;
    };
    /**
     * DeviceCode
     * @description A code that another browser may use. `seconds`: for how long it is valid.
     */
    DeviceCode: {
        id: string;
        code: string;
        seconds: number;
    };
    /**
     * DeviceIsMine
     * @description The answer of the person to a device that has sent their code.
     */
    DeviceIsMine: {
        yes: boolean;
    };
    /**
     * Diagnostic
     * @description The result of one check. `error`: something does not work or is not safe; `warning`: it may
     *     matter; `fine`: without code and remedy. `where`: the file, variable, port or robot.
     */
    Diagnostic: {
        code: string;
        /** @enum {string} */
        severity: "error" | "fine" | "warning";
        where: string;
        message: string;
        remedy: string;
    };
    /**
     * Difference
     * @description The difference between two states of one graph. `before` and `after` are the numbers of the
     *     document's changes at which the graph was in these states.
     */
    Difference: {
        before: number;
        after: number;
        fields: EditorApi["Field"][];
        actions: EditorApi["ActionChange"][];
        relations: EditorApi["RelationChange"][];
        notes: EditorApi["NoteChange"][];
    };
    /**
     * Dispatch
     * @description A child was ready, and its response was carried out.
     */
    Dispatch: {
        /** @enum {string} */
        kind: "dispatch";
        t_ms: number;
        graph: string;
        node: string;
        response: string;
        /** @default  */
        actor?: string;
    };
    /**
     * DocumentStep
     * @description The change `seq` gave a key of a root map another value (docs/contracts.md 1). null is no value.
     *     `overwritten`: the value that the change brought, where another one overwrote it at once; `before` and
     *     `after` are then what the key went on showing.
     */
    DocumentStep: {
        seq: number;
        author: string;
        /** @enum {string} */
        root: "actions" | "comments" | "meta" | "positions" | "relations";
        key: string;
        before: unknown;
        after: unknown;
        /** @default null */
        overwritten?: unknown;
    };
    /**
     * DraftAnswer
     * @description A person's answer to a proposal, given for the draft after its change `seq`.
     */
    DraftAnswer: {
        author: EditorApi["PersonRef"];
        /** Format: date-time */
        at: string;
        yes: boolean;
        note: string;
        seq: number;
    };
    /**
     * DraftConflict
     * @description A conflict between both sides of a draft. `place`: the key by which a choice names it.
     *     `what`: the thing, in words. `removed`: the side that removed it while the other changed it.
     *     `origin`, `draft`: the changes of each side to it.
     */
    DraftConflict: {
        place: string;
        what: string;
        removed: ("draft" | "origin") | null;
        origin: EditorApi["Changes"];
        draft: EditorApi["Changes"];
    };
    /**
     * DraftMoment
     * @description The state with which both sides are compared: the graph `graph` after its change `seq`.
     */
    DraftMoment: {
        graph: string;
        seq: number;
    };
    /**
     * DraftOf
     * @description The origin of a draft: the graph and the change that the draft began with; and the name of
     *     the draft.
     */
    DraftOf: {
        graph: string;
        seq: number;
        name: string;
    };
    /**
     * DraftProposal
     * @description A proposal to merge a draft. `answers`: the last answer of each person, in order of time.
     */
    DraftProposal: {
        author: EditorApi["PersonRef"];
        /** Format: date-time */
        at: string;
        note: string;
        seq: number;
        /** @default [] */
        answers?: EditorApi["DraftAnswer"][];
    };
    /**
     * DraftView
     * @description A draft. `seq`, `origin_seq`: the last changes of draft and origin. `ahead`, `behind`: how
     *     many things the draft and the origin changed since they were equal; null if that is unknown.
     */
    DraftView: {
        id: string;
        name: string;
        origin: string;
        origin_name: string;
        made_by: EditorApi["PersonRef"];
        /** Format: date-time */
        made_at: string;
        /** Format: date-time */
        updated_at: string;
        drafted_seq: number;
        base: EditorApi["DraftMoment"];
        seq: number;
        origin_seq: number;
        /** @enum {string} */
        state: "merged" | "open" | "proposed";
        ahead: number | null;
        behind: number | null;
        proposal?: EditorApi["DraftProposal"];
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
     * EdgeEval
     * @description A child was asked for its response: `parent => child` was evaluated to `result ->
     *     response`.
     */
    EdgeEval: {
        /** @enum {string} */
        kind: "edge";
        t_ms: number;
        graph: string;
        edge: string;
        eval: string;
    };
    /**
     * EditsOfOne
     * @description A request to revert the changes of one person (by id) from the change `from_seq` to `seq`.
     */
    EditsOfOne: {
        author: string;
        from_seq: number;
        seq: number;
    };
    /**
     * EndedSessions
     * @description The number of sessions that were ended.
     */
    EndedSessions: {
        ended: number;
    };
    /**
     * Example
     * @description A graph that comes with the program. Send `umrf` to create a copy of it.
     */
    Example: {
        name: string;
        /** @description A UMRF graph. */
        umrf: {
            [key: string]: unknown;
        };
    };
    /**
     * Extracting
     * @description A request to move actions into a new sub-graph called `name`. `seq`: the change of the graph
     *     that the page shows, the newest if missing. `otherwise`: do it even if the graph may then behave
     *     otherwise.
     */
    Extracting: {
        actions: string[];
        name: string;
        /** @default null */
        seq?: number | null;
        /** @default false */
        otherwise?: boolean;
    };
    /**
     * ExtractionLook
     * @description A preview of moving actions into a sub-graph. `umrf`: the sub-graph; null if it is
     *     impossible, for the `reasons`. `inputs`, `outputs`: types of its parameters by flat name.
     *     `changes`: of the outer document after `seq`. `differences`: ways in which the graph may
     *     behave differently.
     */
    ExtractionLook: {
        seq: number;
        umrf: {
            [key: string]: unknown;
        } | null;
        inputs: {
            [key: string]: string;
        };
        outputs: {
            [key: string]: string;
        };
        changes: EditorApi["KeyChange"][];
        differences: EditorApi["FlatteningReason"][];
        reasons: EditorApi["FlatteningReason"][];
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
     * FieldBlame
     * @description The author of one field. Fields are named as in the keys of the document (docs/contracts.md
     *     1): `in/speed`, `on_true`, "" for the name of an action; also `position`.
     */
    FieldBlame: {
        value: unknown;
        before: unknown;
        author: EditorApi["PersonRef"];
        /** Format: date-time */
        at: string;
        seq: number;
        merged?: EditorApi["MergedBy"];
        /** @default false */
        overwritten?: boolean;
        field: string;
    };
    /**
     * FieldValue
     * @description The value that a person gave a field by the change `seq`, and the value before; null is no
     *     value. `merged`: how the value came from a draft, where that person set it; `seq` is then the
     *     change of the merge. `overwritten`: the field never showed the value, since another person had set
     *     `before` at the same time, without either seeing the other's, and `before` stayed.
     */
    FieldValue: {
        value: unknown;
        before: unknown;
        author: EditorApi["PersonRef"];
        /** Format: date-time */
        at: string;
        seq: number;
        merged?: EditorApi["MergedBy"];
        /** @default false */
        overwritten?: boolean;
    };
    /**
     * Filing
     * @description A folder into which a graph is moved; null: out of all folders.
     */
    Filing: {
        folder: string | null;
    };
    /**
     * FlatCopy
     * @description A request to flatten a graph after its change `seq` into a new graph called `name`.
     */
    FlatCopy: {
        seq: number;
        name: string;
    };
    /**
     * FlatGraph
     * @description A graph with its sub-graphs, flattened into one graph (docs/decisions/069-flatten.md).
     *
     *     `umrf`: the flat graph, under the same name; null if none is known to do the same, for the
     *     `reasons`. `origins`: the graph and action from which each action comes. `left_out`: fields that
     *     are lost.
     */
    FlatGraph: {
        seq: number;
        umrf: {
            [key: string]: unknown;
        } | null;
        origins: EditorApi["FlatOrigin"][];
        left_out: EditorApi["LeftOut"][];
        reasons: EditorApi["FlatteningReason"][];
    };
    /**
     * FlatOrigin
     * @description The origin of an action of the flat graph: the levels from the top graph down to the action
     *     itself.
     */
    FlatOrigin: {
        key: string;
        action: string;
        levels: EditorApi["HierarchyLevel"][];
    };
    /**
     * FlatteningReason
     * @description One reason for which one graph would not do the same as the hierarchy. `at`: the action that
     *     it concerns.
     */
    FlatteningReason: {
        /** @enum {string} */
        code: "actors" | "allowed-values" | "asks-beside" | "begins-again" | "between" | "bypass" | "crash" | "entries" | "exits" | "faulty" | "inputs" | "left-running" | "loop" | "name" | "never-ends" | "otherwise" | "outputs" | "recursion" | "renaming" | "response" | "selection" | "signature" | "spontaneous" | "stops" | "too-large" | "undecided" | "values" | "ways-in" | "ways-out";
        message: string;
        at: EditorApi["HierarchyLevel"][];
    };
    /**
     * Folder
     * @description A folder of graphs. `parent`: the folder in which it lies, if any. `graphs`: how many graphs
     *     lie in it, without those in the folders inside of it. `restricted`: not everybody may see or
     *     edit the graphs in it.
     */
    Folder: {
        id: string;
        name: string;
        parent?: string;
        /** @default 0 */
        graphs?: number;
        /** @default false */
        restricted?: boolean;
    };
    /**
     * GoneBack
     * @description The result of a restore or revert. `seq`: the last change of the graph now. `left`: keys of
     *     actions, notes and arrows that were not fully reverted, since others have changed or used
     *     them.
     */
    GoneBack: {
        seq: number;
        left: string[];
    };
    /**
     * GraphAsAction
     * @description A graph as the action that stands for it in other graphs: its inputs are those that its first
     *     actions lack, its outputs those of its last action. A robot runs it if it has indexed the
     *     graph.
     */
    GraphAsAction: {
        graph: string;
        name: string;
        description: string;
        inputs: EditorApi["LibraryParameter"][];
        outputs: EditorApi["LibraryParameter"][];
    };
    /**
     * GraphMoment
     * @description A graph, and its change that a person has seen.
     */
    GraphMoment: {
        graph: string;
        seq: number;
    };
    /**
     * GraphName
     * @description The id and the name of a graph.
     */
    GraphName: {
        id: string;
        name: string;
    };
    /**
     * GraphResultEvent
     * @description The exit of a graph was reached with this result.
     */
    GraphResultEvent: {
        /** @enum {string} */
        kind: "graph_result";
        t_ms: number;
        graph: string;
        value: string;
    };
    /**
     * GraphStateEvent
     * @description A graph changed its state.
     */
    GraphStateEvent: {
        /** @enum {string} */
        kind: "graph_state";
        t_ms: number;
        graph: string;
        state: string;
    };
    /**
     * GraphView
     * @description A graph, or an action of the library, as lists and pages show it. `seq` counts the changes of
     *     its document.
     *
     *     `damaged`: the first change that cannot be read; the graph stays in the state before it, and
     *     cannot be changed. `people`: who is in it now. `problems`: counts of the check; `wrong` and
     *     `to_fill_in`: counts for people, in which related problems count once. `drafts`: the number of
     *     its drafts. `folder`: the id of the folder in which it lies. `restricted`: not everybody may see
     *     or edit it. `thumbnail`: the digest of its thumbnail, which `GET /api/graphs/thumbnails` gives.
     */
    GraphView: {
        id: string;
        name: string;
        description: string;
        seq: number;
        /** Format: date-time */
        updated_at: string;
        /** Format: date-time */
        made_at: string;
        actions?: number;
        problems?: EditorApi["Counts"];
        wrong?: number;
        to_fill_in?: number;
        /** @default [] */
        robots?: string[];
        /** @default [] */
        labels?: string[];
        /** @default [] */
        people?: EditorApi["PersonRef"][];
        deleted_at?: string;
        damaged?: number;
        /**
         * @default graph
         * @enum {string}
         */
        kind?: "action" | "graph";
        draft_of?: EditorApi["DraftOf"];
        /** @default 0 */
        drafts?: number;
        folder?: string;
        /** @default false */
        restricted?: boolean;
        thumbnail?: string;
    };
    /**
     * Group
     * @description A named set of persons.
     */
    Group: {
        id: string;
        name: string;
    };
    /**
     * GroupName
     * @description The name of a group.
     */
    GroupName: {
        name: string;
    };
    /**
     * Guest
     * @description A person who came in by an invitation. `at`: when that was for the first time.
     */
    Guest: {
        person: EditorApi["PersonRef"];
        /** Format: date-time */
        at: string;
    };
    /**
     * HazardEvent
     * @description The real engine crashes, hangs or does something unwanted here.
     *
     *     See docs/umrf-and-the-engine.md 3. `effect`: `crash` ends the trace; after `hang` no command is
     *     answered; `goes on` warns; `cut off` says that the simulation was not continued.
     */
    HazardEvent: {
        /** @enum {string} */
        kind: "hazard";
        t_ms: number;
        graph: string;
        code: string;
        effect: string;
        node?: string;
        /** @default  */
        message?: string;
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
     * HierarchyLevel
     * @description One step on the way down to an action: a graph, and an action of it by key and full name.
     */
    HierarchyLevel: {
        graph: string;
        key: string;
        action: string;
    };
    /**
     * HistoryEntry
     * @description One entry of the history of a graph, from `at` to `until`.
     *
     *     `seq`: the change after which `…/umrf?at=` and `…/restore` show the graph after this entry.
     *     Edits begin at `from_seq`, and others may have edited in between. `restored`: the change that
     *     was restored; `adapted`: the change of the action whose parameters were taken over; `reverted`:
     *     the edits that were reverted; `merged`: the edits that were merged. `changes`: what this person
     *     changed; null if there is nothing or too much to list.
     */
    HistoryEntry: {
        /** @enum {string} */
        kind: "adapted" | "created" | "deleted" | "edited" | "imported" | "merged" | "published" | "recovered" | "restored" | "reverted";
        author: EditorApi["PersonRef"];
        /** Format: date-time */
        at: string;
        /** Format: date-time */
        until: string;
        seq: number;
        from_seq?: number;
        restored?: number;
        adapted?: EditorApi["TakenFrom"];
        reverted?: EditorApi["Reverted"];
        merged?: EditorApi["MergedIn"];
        version?: EditorApi["VersionView"];
        changes?: EditorApi["Changes"];
    };
    /**
     * ImportReport
     * @description A report on an imported file: its dialect, the notes on what was translated, and its
     *     problems.
     *
     *     `remarks`: the notes with their places; all places are in the file as it was sent.
     */
    ImportReport: {
        dialect: string;
        notes: string[];
        problems: EditorApi["Problem"][];
        remarks: EditorApi["Note"][];
    };
    /**
     * Inbox
     * @description The newest mentions of a person, and how many of them are unread.
     */
    Inbox: {
        unread: number;
        mentions: EditorApi["Mention"][];
    };
    /**
     * InsideGraph
     * @description A graph inside of another one, with its present content. `name`: of the actions that stand
     *     for it; `graph`: its id.
     */
    InsideGraph: {
        name: string;
        digest: string;
        /** @description A UMRF graph. */
        umrf: {
            [key: string]: unknown;
        };
        graph: string;
    };
    /**
     * InsideView
     * @description All graphs inside of a graph after its change `seq`, in their present state, by name;
     *     `digest`, `tree_digest`: those of a version that would be published now. `several`: names
     *     that several graphs have, of which the oldest counts; `cut`: more graphs are inside than
     *     listed.
     */
    InsideView: {
        seq: number;
        digest: string;
        tree_digest: string;
        subgraphs: EditorApi["InsideGraph"][];
        several: string[];
        cut: boolean;
    };
    /**
     * Invitation
     * @description A link as its maker sees it. `path` follows the origin of the page; it holds the secret, and
     *     is left out once the link is revoked. `unrecorded`: that it is revoked is not in the log yet.
     */
    Invitation: {
        id: string;
        /** @enum {string} */
        role: "editor" | "operator" | "owner" | "viewer";
        label: string;
        /** Format: date-time */
        made_at: string;
        made_by: EditorApi["PersonRef"];
        guests: EditorApi["Guest"][];
        path?: string;
        revoked_at?: string;
        revoked_by?: EditorApi["PersonRef"];
        /** @default false */
        unrecorded?: boolean;
    };
    /**
     * InvitationQuestion
     * @description An invitation about which a person asks before using it.
     */
    InvitationQuestion: {
        invitation: string;
    };
    /**
     * Invited
     * @description The role that a link invites to, and who made the link. `name`: of the one person for whom
     *     it is; null for a link for everybody who has it.
     */
    Invited: {
        id: string;
        /** @enum {string} */
        role: "editor" | "operator" | "owner" | "viewer";
        by: string;
        name: string | null;
    };
    /**
     * Inviting
     * @description The request for a new invitation; `label`: a note for whom it is.
     */
    Inviting: {
        /** @enum {string} */
        role: "editor" | "operator" | "viewer";
        /** @default  */
        label?: string;
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
     * KeptAudit
     * @description The time around a run that an owner keeps as an incident: no row of the audit in it is dropped.
     */
    KeptAudit: {
        run: string;
        /** Format: date-time */
        since: string;
        /** Format: date-time */
        until: string;
    };
    /**
     * KeyChange
     * @description The change of one key of the document. A missing `before` or `after` means that the key has
     *     no value.
     */
    KeyChange: {
        root: string;
        key: string;
        /** @description Any JSON value */
        before?: unknown;
        /** @description Any JSON value */
        after?: unknown;
    };
    /**
     * LabelCount
     * @description A label, and how many graphs have it.
     */
    LabelCount: {
        label: string;
        graphs: number;
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
     * LastBuild
     * @description The last reported build of an action's package; null if none was reported.
     */
    LastBuild: {
        build: EditorApi["ActionBuilt"] | null;
    };
    /**
     * LastExamination
     * @description The last result of `doctor`. `age_s`: seconds since it was made, and `took_s`: seconds that it took; both
     *     are null, as `found` is, before the first one. `running_s`: seconds for which the next examination has been
     *     running, null where none is. `failed`: why the last attempt failed; the result before it stays.
     */
    LastExamination: {
        found: EditorApi["Diagnostic"][] | null;
        age_s: number | null;
        took_s: number | null;
        running_s: number | null;
        failed: string | null;
    };
    /**
     * LeftOut
     * @description The description and unknown fields, of an action that was a sub-graph or of that graph, that
     *     the flat graph lacks.
     */
    LeftOut: {
        levels: EditorApi["HierarchyLevel"][];
        fields: string[];
    };
    /**
     * LibraryAction
     * @description An action of the library, or one that graphs use.
     *
     *     `document`: its document in the library, `seq` the last change of that document. Without a
     *     document, the parameters are those of all graphs together; where graphs differ, the graph
     *     changed last counts. `differs_in`: the graphs of `used_in` that use it with other parameters
     *     than the document has. `first_seen`: when the first document or graph with it was made.
     */
    LibraryAction: {
        name: string;
        description: string;
        type: string;
        inputs: EditorApi["LibraryParameter"][];
        outputs: EditorApi["LibraryParameter"][];
        used_in: string[];
        /** Format: date-time */
        first_seen: string;
        document: string | null;
        seq: number | null;
        labels: string[];
        differs_in: string[];
    };
    /**
     * LibraryParameter
     * @description One parameter. `path`: keys joined with `/` as in UMRF. `pvf_type`: missing if the file names
     *     none. `text`: the JSON with which a new use begins: with the value of a library document, but
     *     without values of graphs.
     */
    LibraryParameter: {
        path: string;
        pvf_type: string | null;
        required: boolean;
        text: string;
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
     * LoginBegun
     * @description The code for the person, and the secret with which the program fetches its token. `interval`:
     *     seconds between two questions.
     */
    LoginBegun: {
        code: string;
        secret: string;
        interval: number;
        expires_in: number;
    };
    /**
     * LoginCode
     * @description The code that the program shows, as a person types it.
     */
    LoginCode: {
        code: string;
    };
    /**
     * LoginRequest
     * @description A login that waits for a person, as that person sees it. `address`: from where the program
     *     asks, "" for the server's own computer. `state`: `confirmed` until the program has fetched its
     *     token. `expires_in`: seconds.
     */
    LoginRequest: {
        code: string;
        name: string;
        scopes: ("edit" | "hooks" | "operate" | "read" | "scrape" | "simulate")[];
        address: string;
        expires_in: number;
        /** @enum {string} */
        state: "confirmed" | "fetched" | "waiting";
        days?: number;
    };
    /**
     * LoginSecret
     * @description The secret that the program got when it began the login.
     */
    LoginSecret: {
        secret: string;
    };
    /**
     * MadeGraph
     * @description A new graph. `reading`: the report on the file it was read from, if any.
     */
    MadeGraph: {
        id: string;
        name: string;
        description: string;
        seq: number;
        /** Format: date-time */
        updated_at: string;
        /** Format: date-time */
        made_at: string;
        actions?: number;
        problems?: EditorApi["Counts"];
        wrong?: number;
        to_fill_in?: number;
        /** @default [] */
        robots?: string[];
        /** @default [] */
        labels?: string[];
        /** @default [] */
        people?: EditorApi["PersonRef"][];
        deleted_at?: string;
        damaged?: number;
        /**
         * @default graph
         * @enum {string}
         */
        kind?: "action" | "graph";
        draft_of?: EditorApi["DraftOf"];
        /** @default 0 */
        drafts?: number;
        folder?: string;
        /** @default false */
        restricted?: boolean;
        thumbnail?: string;
        reading?: EditorApi["ImportReport"];
    };
    /**
     * MadeSubGraph
     * @description A new graph, and the changes that put an action for it into the document of the outer graph.
     *     The page makes these changes.
     */
    MadeSubGraph: {
        graph: EditorApi["GraphView"];
        changes: EditorApi["KeyChange"][];
    };
    /**
     * MadeToken
     * @description A new token. `token`: its text, which is not stored and never shown again.
     */
    MadeToken: {
        token: string;
        record: EditorApi["TokenRecord"];
    };
    /**
     * MakeToken
     * @description The request for a new token. `days`: its life; by default 90, or less where the server says
     *     so.
     */
    MakeToken: {
        name: string;
        scopes: ("edit" | "hooks" | "operate" | "read" | "scrape" | "simulate")[];
        /** @default null */
        days?: number | null;
    };
    /**
     * Member
     * @description A person as owners see them. `groups`: ids. `until`: when the right to do more than Stop ends.
     *     `links`: the newest first, for owners only. `unrecorded`: that the person is ended is not in
     *     the log yet. `provider`: null for a person who comes by personal links only.
     */
    Member: {
        id: string;
        name: string;
        /** @enum {string} */
        role: "editor" | "operator" | "owner" | "viewer";
        groups: string[];
        /** Format: date-time */
        made_at: string;
        made_by: EditorApi["PersonRef"];
        until?: string;
        ended_at?: string;
        ended_by?: EditorApi["PersonRef"];
        /** @default false */
        unrecorded?: boolean;
        /** @default [] */
        links?: EditorApi["PersonalLink"][];
        provider?: EditorApi["ByProvider"];
    };
    /**
     * MemberChange
     * @description A change of a person; what is missing stays. `until`: null takes the date away.
     */
    MemberChange: {
        name?: string;
        /** @enum {string} */
        role?: "editor" | "operator" | "owner" | "viewer";
        groups?: string[];
        until?: string | null;
    };
    /**
     * Members
     * @description All persons with personal links, and all groups. `origins`: the addresses of the page for
     *     other people, the likeliest first.
     */
    Members: {
        people: EditorApi["Member"][];
        groups: EditorApi["Group"][];
        origins: string[];
    };
    /**
     * Mention
     * @description A comment in which the person is mentioned. `key`: of the comment in its document; `author`:
     *     by the log; `text`: its beginning.
     */
    Mention: {
        key: string;
        graph: string;
        graph_name: string;
        author: EditorApi["PersonRef"];
        /** Format: date-time */
        at: string;
        text: string;
        is_read: boolean;
    };
    /**
     * MergePreview
     * @description The effect of a merge on the side `into`, where a conflict without a choice keeps this side's
     *     value. `seq`, `draft_seq`: the compared changes of origin and draft. `changes`: what would
     *     change. `problems`: those that would be new. `umrf`: the resulting text. `authors`: the
     *     people whose changes are merged. `origin_did`, `draft_did`: the changes of each side since
     *     the last merge.
     */
    MergePreview: {
        /** @enum {string} */
        into: "draft" | "origin";
        seq: number;
        draft_seq: number;
        changes: EditorApi["Changes"];
        conflicts: EditorApi["DraftConflict"][];
        problems: EditorApi["Problem"][];
        umrf: string;
        authors: EditorApi["PersonRef"][];
        origin_did: EditorApi["Changes"];
        draft_did: EditorApi["Changes"];
    };
    /**
     * MergedBy
     * @description The origin of a merged value: the graph and its change there, who merged it and when, and the
     *     name of the draft.
     */
    MergedBy: {
        graph: string;
        seq: number;
        name: string;
        by: EditorApi["PersonRef"];
        /** Format: date-time */
        at: string;
    };
    /**
     * MergedDraft
     * @description The graph that was merged into, its last change now, and whether the merge changed it.
     */
    MergedDraft: {
        graph: string;
        seq: number;
        changed: boolean;
    };
    /**
     * MergedGraph
     * @description The result of storing an edited text. `seq`: the last change of the graph; `merged`: whether others had
     *     changed the graph since the text was read; `problems`: errors that the text brought in.
     */
    MergedGraph: {
        seq: number;
        merged: boolean;
        problems: EditorApi["Problem"][];
    };
    /**
     * MergedIn
     * @description The edits that were merged: the changes `from_seq` to `seq` of the graph `source`, and their authors.
     *     `source` is the draft called `name`, or the graph of which that is a draft.
     */
    MergedIn: {
        draft: string;
        name: string;
        source: string;
        from_seq: number;
        seq: number;
        authors: EditorApi["PersonRef"][];
    };
    /**
     * MovingFolder
     * @description A folder into which another one is moved; null: out of all folders.
     */
    MovingFolder: {
        parent: string | null;
    };
    /**
     * NewDraft
     * @description A request for a draft: its name, and the change of the graph that it begins with (missing:
     *     the last one).
     */
    NewDraft: {
        /** @default  */
        name?: string;
        /** @default null */
        seq?: number | null;
    };
    /**
     * NewFolder
     * @description A request for a folder in `parent`; null: in no folder.
     */
    NewFolder: {
        name: string;
        /** @default null */
        parent?: string | null;
    };
    /**
     * NewLink
     * @description The request for a new link of a person. `hours`: for how long it is valid.
     */
    NewLink: {
        /** @default 72 */
        hours?: number;
    };
    /**
     * NewMember
     * @description The request for a new person. `until`: when their right to do more than Stop ends; `hours`:
     *     for how long the link is valid.
     */
    NewMember: {
        name: string;
        /** @enum {string} */
        role: "editor" | "operator" | "owner" | "viewer";
        /** @default [] */
        groups?: string[];
        /** @default null */
        until?: string | null;
        /** @default 72 */
        hours?: number;
    };
    /**
     * NewPasskey
     * @description A passkey that a browser has made: its `PublicKeyCredential` as JSON.
     */
    NewPasskey: {
        name: string;
        credential: Record<string, unknown>;
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
     * NodeResultEvent
     * @description A visit of an action ended with this result; the real engine reports it to no client.
     */
    NodeResultEvent: {
        /** @enum {string} */
        kind: "node_result";
        t_ms: number;
        graph: string;
        node: string;
        result: string;
        message?: string;
        /** @default  */
        actor?: string;
    };
    /**
     * NodeStateEvent
     * @description An action changed its state. Times are milliseconds on the caller's clock.
     *
     *     `actor`: the actor that performs the action, here and in other events; "" if none is named. An
     *     action of a sub-graph that names none belongs to the actor of the action that stands for it.
     */
    NodeStateEvent: {
        /** @enum {string} */
        kind: "node_state";
        t_ms: number;
        graph: string;
        node: string;
        state: string;
        /** @default  */
        actor?: string;
    };
    /**
     * NotReady
     * @description A child waits for inputs or for required parents.
     */
    NotReady: {
        /** @enum {string} */
        kind: "not_ready";
        t_ms: number;
        graph: string;
        node: string;
        why: string;
    };
    /**
     * Note
     * @description A remark on something in a text that was translated or dropped when it was read. `times`: how
     *     often that was; `where`: the first place; `also`: the others (the first thousand of them).
     */
    Note: {
        message: string;
        where: EditorApi["Where"];
        /** @default 1 */
        times?: number;
        /** @default [] */
        also?: EditorApi["Where"][];
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
     * OpenSession
     * @description A browser that is signed in. `invitation`: the id of the invitation by which it came in; it
     *     is missing if it came in by the token or a personal link. `browser`: its name and system, as it
     *     says; `address`: where it signed in, missing for this computer itself. `used_at`: the last use,
     *     to the minute.
     */
    OpenSession: {
        id: string;
        person: EditorApi["Person"];
        /** Format: date-time */
        since: string;
        /** Format: date-time */
        expires: string;
        invitation?: string;
        /** @default  */
        browser?: string;
        /** @default  */
        address?: string;
        used_at?: string;
        /** @default false */
        personal?: boolean;
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
     * OwnConfirmation
     * @description The last confirmation of the session that asks; null if there was none.
     */
    OwnConfirmation: {
        last: EditorApi["Confirmation"] | null;
    };
    /**
     * OwnDevices
     * @description The open sessions of the person; `this`: the id of the one that asks. `origins`: the
     *     addresses of the page for other devices, the likeliest first. `ends`: by session the seal with
     *     which a runner that has a data folder of its own is told of its end.
     */
    OwnDevices: {
        sessions: EditorApi["OpenSession"][];
        this: string;
        origins: string[];
        ends: {
            [key: string]: string;
        };
    };
    /**
     * OwnPasskeys
     * @description The passkeys of the person, and after how many minutes what only owners do needs a new
     *     confirmation of them; 0: never.
     */
    OwnPasskeys: {
        passkeys: EditorApi["PasskeyShown"][];
        ask_again: number;
    };
    /**
     * OwnerAsked
     * @description Minutes after which what only owners do needs a new confirmation of this owner; 0: never.
     */
    OwnerAsked: {
        ask_again: number;
    };
    /**
     * PackageContents
     * @description All files of the package of an action.
     */
    PackageContents: {
        seq: number;
        action: string;
        package: string;
        files: EditorApi["PackageFile"][];
    };
    /**
     * PackageFile
     * @description A file of a package.
     */
    PackageFile: {
        path: string;
        text: string;
    };
    /**
     * PackageList
     * @description The packages of a graph after its change `seq`: one for each distinct name of an action.
     */
    PackageList: {
        seq: number;
        packages: EditorApi["PackageOutline"][];
        refusals: EditorApi["PackageRefusal"][];
    };
    /**
     * PackageOutline
     * @description A package that can be made: of which action, its name, its files (with `/`).
     */
    PackageOutline: {
        action: string;
        package: string;
        files: string[];
    };
    /**
     * PackageRefusal
     * @description The reason why an action has no package. `place`: the name of the action, and below it a JSON pointer.
     */
    PackageRefusal: {
        action: string;
        place: string;
        reason: string;
    };
    /**
     * Participant
     * @description A person who has acted on this server. `color`: unique among the people who are connected; grey for a
     *     person who has none.
     */
    Participant: {
        id: string;
        name: string;
        color: string;
    };
    /**
     * PasskeyName
     * @description The new name of a passkey.
     */
    PasskeyName: {
        name: string;
    };
    /**
     * PasskeyOptions
     * @description The options for `navigator.credentials`, as its functions for JSON take them.
     */
    PasskeyOptions: {
        options: Record<string, unknown>;
    };
    /**
     * PasskeyProof
     * @description The answer of a passkey to a challenge, as JSON.
     */
    PasskeyProof: {
        credential: Record<string, unknown>;
    };
    /**
     * PasskeyShown
     * @description A passkey in a list. `rp`: the host name at which it works; `counts_at`: from when on it
     *     confirms.
     */
    PasskeyShown: {
        id: string;
        name: string;
        rp: string;
        /** Format: date-time */
        made_at: string;
        /** Format: date-time */
        counts_at: string;
    };
    /**
     * PastDocument
     * @description The root maps of a document as they were after its change `seq` (docs/contracts.md 1).
     */
    PastDocument: {
        meta: Record<string, unknown>;
        actions: Record<string, unknown>;
        relations: Record<string, unknown>;
        positions: Record<string, unknown>;
        comments: Record<string, unknown>;
    };
    /**
     * Person
     * @description A person with a role, which says what they may do.
     */
    Person: {
        id: string;
        name: string;
        /** @enum {string} */
        role: "editor" | "operator" | "owner" | "viewer";
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
     * PersonalLink
     * @description A link for one person. `path` follows the origin of the page; it holds the secret, and is
     *     left out once the link opens nothing. `browser`, `address`: of the browser that used it.
     */
    PersonalLink: {
        id: string;
        /** Format: date-time */
        made_at: string;
        made_by: EditorApi["PersonRef"];
        /** Format: date-time */
        expires_at: string;
        path?: string;
        used_at?: string;
        /** @default  */
        browser?: string;
        /** @default  */
        address?: string;
        withdrawn_at?: string;
    };
    /**
     * Pieces
     * @description A UMRF text as keys and values of a document. `notes`: what was translated; `remarks`: the
     *     notes with their places in the text.
     */
    Pieces: {
        dialect: string;
        notes: string[];
        name: string;
        actions: Record<string, unknown>;
        relations: Record<string, unknown>;
        positions: Record<string, unknown>;
        remarks: EditorApi["Note"][];
    };
    /**
     * PinnedGraph
     * @description A graph inside of a version, with its content at publication. `name`: of the actions that
     *     stand for it; `graph`: its id; `version`: its newest version with that content, null if none.
     *     `current_digest`: of the graph that has the name now, null if none has.
     */
    PinnedGraph: {
        name: string;
        version: string | null;
        digest: string;
        /** @description A UMRF graph. */
        umrf: {
            [key: string]: unknown;
        };
        graph: string;
        current_digest: string | null;
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
        where?: EditorApi["Where"];
    };
    /**
     * Preview
     * @description The graph that importing a file would make. `problems`: those of the file, then those of the
     *     graph. `remarks`: the notes with their places; all places are in the file as it was sent.
     */
    Preview: {
        dialect: string;
        notes: string[];
        problems: EditorApi["Problem"][];
        name: string;
        actions: number;
        remarks: EditorApi["Note"][];
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
        where: EditorApi["Where"];
        message: string;
        fix?: string;
        /** @default [] */
        also?: EditorApi["Where"][];
        inside?: EditorApi["PlaceInside"];
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
     * Problems
     * @description The problems of a graph after its change `seq`.
     */
    Problems: {
        seq: number;
        problems: EditorApi["Problem"][];
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
        versions: EditorApi["ProcessVersions"];
        readiness: EditorApi["Readiness"];
        load: EditorApi["Load"];
        journal: EditorApi["JournalState"];
        storage: EditorApi["StorageShown"] | null;
        workers: EditorApi["LaneState"][];
        activity: EditorApi["Activity"];
        backups: EditorApi["BackupsShown"] | null;
        faults: EditorApi["Fault"][];
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
     * Proposing
     * @description The note that goes with a proposal to merge a draft.
     */
    Proposing: {
        /** @default  */
        note?: string;
    };
    /**
     * ProviderAnswer
     * @description The parameters with which the provider sent the browser back, as they stand in the address.
     */
    ProviderAnswer: {
        state: string;
        /** @default null */
        code?: string | null;
        /** @default null */
        iss?: string | null;
        /** @default null */
        error?: string | null;
        /** @default null */
        error_description?: string | null;
    };
    /**
     * ProviderBegin
     * @description The request to sign in by the provider. `goal`: the path of the page to be shown afterwards.
     *     `again`: the person is signed in, and proves that it is they.
     */
    ProviderBegin: {
        /** @default / */
        goal?: string;
        /** @default false */
        again?: boolean;
    };
    /**
     * ProviderOffer
     * @description The provider by which people may sign in from the address that they came to. `name`: null where
     *     there is none. `mine`: the person who asks came by it, and can prove by it that it is they.
     */
    ProviderOffer: {
        name: string | null;
        mine: boolean;
    };
    /**
     * ProviderResult
     * @description The end of a sign-in. `goal`: the path of the page to be shown now. `signed_in`: null if a person
     *     who was signed in has only proved that it is they.
     */
    ProviderResult: {
        goal: string;
        signed_in: EditorApi["SignedIn"] | null;
    };
    /**
     * ProviderVisit
     * @description The address of the provider to which the browser has to go now.
     */
    ProviderVisit: {
        url: string;
    };
    /**
     * Publishing
     * @description A request to publish a version. `seq`: the change of the graph to publish, the newest if
     *     missing.
     */
    Publishing: {
        /** @default  */
        label?: string;
        /** @default null */
        seq?: number | null;
        /** @default  */
        note?: string;
    };
    /**
     * ReadMentions
     * @description The keys of mentions that the person has read.
     */
    ReadMentions: {
        keys: string[];
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
     * RefusedUse
     * @description A graph of which an edit failed, and why.
     */
    RefusedUse: {
        graph: string;
        why: string;
    };
    /**
     * Rehearsal
     * @description The events of a simulated run, in order. `cut`: the list is incomplete; `asked`: the inputs
     *     for which a start of the graph asks.
     */
    Rehearsal: {
        seq: number;
        trace: (EditorApi["NodeStateEvent"] | EditorApi["GraphStateEvent"] | EditorApi["EdgeEval"] | EditorApi["Dispatch"] | EditorApi["NotReady"] | EditorApi["GraphResultEvent"] | EditorApi["HazardEvent"] | EditorApi["NodeResultEvent"])[];
        cut: boolean;
        asked: EditorApi["AskedInput"][];
    };
    /**
     * RehearsedPart
     * @description The part of a graph that is simulated: the actions `at`, by full name, and all that may follow, or
     *     `only` these.
     */
    RehearsedPart: {
        at: string[];
        /** @default false */
        only?: boolean;
    };
    /**
     * Rehearsing
     * @description A request to simulate the graph after its change `seq` (missing: the newest). `script`: what
     *     its actions do, as in a script of `simulate`; `commands`: what people do during the run;
     *     `values`: those of inputs for which a start asks; `from`: where it begins, if not at the entry.
     */
    Rehearsing: {
        /** @default null */
        seq?: number | null;
        /** @default null */
        script?: EditorApi["Script"];
        /** @default [] */
        commands?: EditorApi["Command"][];
        /** @default 3600000 */
        for_ms?: number;
        /** @default {} */
        values?: {
            [key: string]: {
                [key: string]: boolean | number | string | (boolean | number | string)[];
            };
        };
        /** @default null */
        from?: EditorApi["RehearsedPart"] | null;
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
        fields: EditorApi["Field"][];
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
     * ReleaseView
     * @description The owner who released a version, and when.
     */
    ReleaseView: {
        by: EditorApi["PersonRef"];
        /** Format: date-time */
        at: string;
    };
    /**
     * Renames
     * @description The parameters that a library has renamed: pairs of the old path and the new path.
     */
    Renames: {
        inputs: [
            string,
            string
        ][];
        outputs: [
            string,
            string
        ][];
    };
    /**
     * RenamingFolder
     * @description Another name of a folder.
     */
    RenamingFolder: {
        name: string;
    };
    /**
     * Restoring
     * @description The change to whose state the graph is restored; with `of` only the action, arrow or note
     *     with this key is.
     */
    Restoring: {
        seq: number;
        /** @default null */
        of?: string | null;
    };
    /**
     * Reverted
     * @description The edits that were reverted: their author, the first and the last change.
     */
    Reverted: {
        author: EditorApi["PersonRef"];
        from_seq: number;
        seq: number;
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
     * RuleView
     * @description The own rule of a graph or folder, if any, the rule that counts for it, and the one that would
     *     count without an own one.
     */
    RuleView: {
        own: EditorApi["Rule"] | null;
        counts: EditorApi["Rule"];
        around: EditorApi["Rule"];
    };
    /**
     * Ruling
     * @description A new rule; null: that of the folder around it counts.
     */
    Ruling: {
        rule: EditorApi["Rule"] | null;
    };
    /**
     * RunLink
     * @description A link from each run on a robot to what another program recorded of it. `url`: with places such
     *     as `{robot}` and `{from}`, which the page fills in.
     */
    RunLink: {
        name: string;
        url: string;
    };
    /**
     * Script
     * @description Behaviours of actions by key. A key has one behaviour for each call of the action; the last
     *     one repeats.
     */
    Script: {
        /** @default {} */
        behaviours?: {
            [key: string]: EditorApi["Behaviour"][];
        };
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
     * SharedGraph
     * @description A graph as a link shows it, as it is now. `problems`: of the graph alone, without those of the
     *     graphs that its actions stand for.
     */
    SharedGraph: {
        /** @description A UMRF graph. */
        umrf: {
            [key: string]: unknown;
        };
        problems: EditorApi["Problem"][];
    };
    /**
     * SharedGraphChanged
     * @description The graph of a link may have changed; sent once for many changes.
     */
    SharedGraphChanged: Record<string, unknown>;
    /**
     * Sharing
     * @description The addresses of this server for other people, and the invitation links.
     *
     *     `origins`: the addresses of the page, the likeliest first; empty where the server listens on this computer
     *     only. `secure`: whether the connection is encrypted. `proxied`: whether a proxy serves the first address, so
     *     that the certificate is the proxy's.
     */
    Sharing: {
        origins: string[];
        secure: boolean;
        invitations: EditorApi["Invitation"][];
        proxied: boolean;
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
        rules: EditorApi["Rule"][];
        at: number;
        seal: string;
    };
    /**
     * SignIn
     * @description The body of a sign-in: the token or an invitation, and optionally the person's name. A
     *     signed-in person may send only a new name.
     *
     *     An invitation is `ID.SECRET`, as its link has it.
     */
    SignIn: {
        /** @default null */
        token?: string | null;
        /** @default null */
        invitation?: string | null;
        /** @default null */
        name?: string | null;
    };
    /**
     * SignedIn
     * @description The person who is signed in. `named` is false until the person has given a name. `personal`:
     *     an owner has given it, since the person came by a personal link.
     */
    SignedIn: {
        person: EditorApi["Person"];
        named: boolean;
        personal: boolean;
    };
    /**
     * SinceWhen
     * @description The changes between `good` and `bad` after which the course of a graph differs, in order of
     *     time. `same`: the course at `bad` equals that at `good`. `exact`: there are certainly no
     *     others; otherwise only some changes were simulated, and the course may have changed and
     *     changed back between them. `looked`: the number of simulations.
     */
    SinceWhen: {
        good: number;
        bad: number;
        same: boolean;
        exact: boolean;
        looked: number;
        partings: EditorApi["CourseChange"][];
    };
    /**
     * Site
     * @description A runner of a page that leads several. `name`: for people; `url`: without a slash at its
     *     end.
     */
    Site: {
        name: string;
        url: string;
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
        rules: EditorApi["Rule"][];
        graphs: {
            [key: string]: number;
        };
        seal: string;
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
     * StoredEvent
     * @description The header of one event of the log. `seq` counts the events of `stream`.
     */
    StoredEvent: {
        position: number;
        stream: string;
        seq: number;
        kind: string;
        author: EditorApi["PersonRef"];
        /** Format: date-time */
        at: string;
        graph?: string;
    };
    /**
     * TakenFrom
     * @description The document whose parameters were taken over, "" for a file, its change then, and the name of
     *     the action. `document`: null for a graph that the person who asks may not see.
     */
    TakenFrom: {
        document: string | null;
        seq: number;
        action: string;
    };
    /**
     * TakingOver
     * @description The graph with the use whose parameters the library takes over, and the key (`aid`) of that
     *     action; if missing, the first use that differs.
     */
    TakingOver: {
        graph: string;
        /** @default null */
        aid?: string | null;
    };
    /**
     * TextEdit
     * @description The changes that an edited text makes to the graph after the change `seq`, and the new
     *     errors, with their places in the text.
     */
    TextEdit: {
        seq: number;
        changes: EditorApi["KeyChange"][];
        problems: EditorApi["Problem"][];
    };
    /**
     * Thumbnail
     * @description A graph as its thumbnail shows it. `actions`: the index of the robot in `robots`, -1 for none,
     *     and the length of the name; `arrows`: where each begins and ends, and the first outcome at which
     *     it leads on, as an index in `PRECONDITIONS`. An end of an arrow is 0 for the entry, the number
     *     of an action from 1, or after the last one the exit.
     */
    Thumbnail: {
        robots: string[];
        actions: [
            number,
            number
        ][];
        arrows: [
            number,
            number,
            number
        ][];
    };
    /**
     * ThumbnailOf
     * @description The thumbnail of the graph with this id, as the list names it by its `digest`.
     */
    ThumbnailOf: {
        graph: string;
        digest: string;
        thumbnail: EditorApi["Thumbnail"];
    };
    /**
     * TokenList
     * @description The tokens of a server. `most_days`: the longest life that a new one may get.
     */
    TokenList: {
        tokens: EditorApi["TokenShown"][];
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
        person: EditorApi["PersonRef"];
        made_at: number;
        expires: number;
        invitation?: string;
        /** @default  */
        seal?: string;
    };
    /**
     * TokenShown
     * @description A token in a list. `used` is missing if the process never saw it.
     */
    TokenShown: {
        record: EditorApi["TokenRecord"];
        used?: EditorApi["TokenUse"];
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
     * UnpackingAction
     * @description A request to replace an action by the actions of the graph that it stands for. `seq`: the
     *     change of the graph that the page shows, the newest if missing. `at`: where the action is drawn,
     *     if it has no stored position.
     */
    UnpackingAction: {
        action: string;
        /** @default null */
        seq?: number | null;
        /** @default null */
        at?: [
            number,
            number
        ] | null;
    };
    /**
     * UnpackingLook
     * @description A preview of replacing an action by the actions of the graph `inside`. `changes`: of the
     *     document after `seq`; empty if it is impossible, for the `reasons`. `actions`: the keys of
     *     the new actions; `differences`: ways in which the graph may behave differently; `left_out`:
     *     fields that are lost.
     */
    UnpackingLook: {
        seq: number;
        inside: string;
        changes: EditorApi["KeyChange"][];
        actions: string[];
        differences: EditorApi["FlatteningReason"][];
        left_out: string[];
        reasons: EditorApi["FlatteningReason"][];
    };
    /**
     * UpdatedGraph
     * @description A graph after an update of its uses. `seq`: its newest change; `changed`: whether that is new;
     *     `refused`: why the update of this graph failed, after others were changed; "" if it did not.
     */
    UpdatedGraph: {
        graph: string;
        seq: number;
        changed: boolean;
        refused: string;
    };
    /**
     * UpdatingUses
     * @description A request to update uses of an action to its change `seq`. `renames`: parameters that have another name
     *     since.
     */
    UpdatingUses: {
        seq: number;
        graphs: EditorApi["GraphMoment"][];
        /**
         * @default {
         *       "inputs": [],
         *       "outputs": []
         *     }
         */
        renames?: EditorApi["Renames"];
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
     * VersionView
     * @description A version. `umrf`: the graph as text, kept unchanged; `subgraphs`: all graphs inside, by
     *     name; lists omit both. `tree_digest`: of the graph together with them, null for old versions.
     *     `released`: by which owner it was released, null if it is not.
     */
    VersionView: {
        id: string;
        graph: string;
        label: string;
        digest: string;
        seq: number;
        author: EditorApi["PersonRef"];
        /** Format: date-time */
        at: string;
        tree_digest: string | null;
        umrf?: {
            [key: string]: unknown;
        };
        /** @default  */
        note?: string;
        subgraphs?: EditorApi["PinnedGraph"][];
        released?: EditorApi["ReleaseView"];
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
        made_by: EditorApi["PersonRef"];
        /** Format: date-time */
        made_at: string;
        /** Format: date-time */
        expires: string;
        path: string;
        opened: number;
        opened_at: string | null;
    };
    /**
     * ViewPlaces
     * @description The address of the runner, without a slash at its end, and the origins of sites that may show
     *     links in a frame. `more_runners`: the addresses of further runners, one of which may have the run of
     *     the link; absent with one.
     */
    ViewPlaces: {
        runner_url: string;
        frame_origins: string[];
        more_runners?: string[];
    };
    /**
     * WaitingDevice
     * @description The answer to the browser that has sent a code: `claim`, with which it asks for its session,
     *     the name of the person, and the number that both browsers show.
     */
    WaitingDevice: {
        claim: string;
        person: string;
        number: string;
    };
    /**
     * WantedMerge
     * @description The merge that was previewed: of the origin after its change `seq`, and of the draft after
     *     its change `draft_seq`.
     */
    WantedMerge: {
        seq: number;
        draft_seq: number;
        /**
         * @default origin
         * @enum {string}
         */
        into?: "draft" | "origin";
        /** @default {} */
        choices?: {
            [key: string]: "draft" | "origin";
        };
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
}

export interface EditorPaths {
    "/api/session": {
        get: EditorOperations["getSession"];
        post: EditorOperations["signIn"];
        delete: EditorOperations["signOut"];
    };
    "/api/session/invitation": {
        post: EditorOperations["lookAtInvitation"];
    };
    "/api/session/device": {
        post: EditorOperations["sendDeviceCode"];
    };
    "/api/session/device/answer": {
        post: EditorOperations["collectDevice"];
    };
    "/api/session/provider": {
        get: EditorOperations["getProvider"];
        post: EditorOperations["beginProvider"];
    };
    "/api/session/provider/answer": {
        post: EditorOperations["answerProvider"];
    };
    "/api/invitations": {
        get: EditorOperations["listInvitations"];
        post: EditorOperations["invite"];
    };
    "/api/invitations/{invitation}/revoke": {
        post: EditorOperations["revokeInvitation"];
    };
    "/api/invitations/{invitation}/qr": {
        get: EditorOperations["getInvitationCode"];
    };
    "/api/sessions": {
        get: EditorOperations["listSessions"];
    };
    "/api/sessions/{session}/end": {
        post: EditorOperations["endSession"];
    };
    "/api/members": {
        get: EditorOperations["listMembers"];
        post: EditorOperations["addMember"];
    };
    "/api/members/{person}": {
        patch: EditorOperations["changeMember"];
    };
    "/api/members/{person}/link": {
        post: EditorOperations["linkMember"];
    };
    "/api/members/{person}/qr": {
        get: EditorOperations["getMemberCode"];
    };
    "/api/members/{person}/end": {
        post: EditorOperations["endMember"];
    };
    "/api/people/{person}/sessions/end": {
        post: EditorOperations["endSessionsOf"];
    };
    "/api/groups": {
        post: EditorOperations["makeGroup"];
    };
    "/api/groups/{group}": {
        delete: EditorOperations["removeGroup"];
        patch: EditorOperations["renameGroup"];
    };
    "/api/config": {
        get: EditorOperations["getConfig"];
    };
    "/api/people": {
        get: EditorOperations["listPeople"];
    };
    "/api/examples": {
        get: EditorOperations["listExamples"];
    };
    "/api/events": {
        get: EditorOperations["followEvents"];
    };
    "/api/graphs": {
        get: EditorOperations["listGraphs"];
        post: EditorOperations["createGraph"];
    };
    "/api/graphs/names": {
        get: EditorOperations["listGraphNames"];
    };
    "/api/graphs/labels": {
        get: EditorOperations["listGraphLabels"];
    };
    "/api/graphs/thumbnails": {
        get: EditorOperations["listThumbnails"];
    };
    "/api/graphs/{graph_id}": {
        get: EditorOperations["getGraph"];
        delete: EditorOperations["deleteGraph"];
        patch: EditorOperations["describeGraph"];
    };
    "/api/graphs/{graph_id}/recover": {
        post: EditorOperations["recoverGraph"];
    };
    "/api/graphs/{graph_id}/umrf": {
        get: EditorOperations["getUmrf"];
        put: EditorOperations["putUmrf"];
    };
    "/api/graphs/{graph_id}/problems": {
        get: EditorOperations["getProblems"];
    };
    "/api/graphs/{graph_id}/breakpoints": {
        get: EditorOperations["getBreakpoints"];
    };
    "/api/graphs/{graph_id}/rewriting": {
        post: EditorOperations["getRewriting"];
    };
    "/api/folders": {
        get: EditorOperations["listFolders"];
        post: EditorOperations["makeFolder"];
    };
    "/api/folders/{folder_id}": {
        delete: EditorOperations["removeFolder"];
        patch: EditorOperations["renameFolder"];
    };
    "/api/folders/{folder_id}/parent": {
        put: EditorOperations["moveFolder"];
    };
    "/api/graphs/{graph_id}/folder": {
        put: EditorOperations["fileGraph"];
    };
    "/api/graphs/{graph_id}/rule": {
        get: EditorOperations["getGraphRule"];
        put: EditorOperations["putGraphRule"];
    };
    "/api/folders/{folder_id}/rule": {
        get: EditorOperations["getFolderRule"];
        put: EditorOperations["putFolderRule"];
    };
    "/api/graph-rules": {
        get: EditorOperations["getGraphRules"];
    };
    "/api/graphs/{graph_id}/history": {
        get: EditorOperations["getHistory"];
    };
    "/api/graphs/{graph_id}/document": {
        get: EditorOperations["getDocument"];
    };
    "/api/graphs/{graph_id}/changes": {
        get: EditorOperations["getChanges"];
    };
    "/api/graphs/{graph_id}/diff": {
        get: EditorOperations["getDifference"];
    };
    "/api/graphs/{graph_id}/blame": {
        get: EditorOperations["getBlame"];
    };
    "/api/graphs/{graph_id}/blame/values": {
        get: EditorOperations["getValues"];
    };
    "/api/graphs/{graph_id}/since": {
        post: EditorOperations["getSince"];
    };
    "/api/graphs/{graph_id}/restore": {
        post: EditorOperations["restoreGraph"];
    };
    "/api/graphs/{graph_id}/revert": {
        post: EditorOperations["revertGraph"];
    };
    "/api/mentions": {
        get: EditorOperations["listMentions"];
    };
    "/api/mentions/read": {
        post: EditorOperations["readMentions"];
    };
    "/api/graphs/{graph_id}/versions": {
        get: EditorOperations["listVersions"];
        post: EditorOperations["publishVersion"];
    };
    "/api/graphs/{graph_id}/subgraphs": {
        get: EditorOperations["getSubgraphs"];
        post: EditorOperations["makeSubGraph"];
    };
    "/api/graphs/{graph_id}/subgraphs.zip": {
        get: EditorOperations["downloadSubgraphs"];
    };
    "/api/versions/{version_id}": {
        get: EditorOperations["getVersion"];
    };
    "/api/versions/{version_id}/breakpoints": {
        get: EditorOperations["getVersionBreakpoints"];
    };
    "/api/versions/{version_id}/sight": {
        get: EditorOperations["getSight"];
    };
    "/api/versions/{version_id}/release": {
        put: EditorOperations["releaseVersion"];
        delete: EditorOperations["withdrawRelease"];
    };
    "/api/graphs/{graph_id}/flat": {
        get: EditorOperations["getFlatGraph"];
        post: EditorOperations["makeFlatGraph"];
    };
    "/api/graphs/{graph_id}/extraction": {
        post: EditorOperations["lookAtExtraction"];
    };
    "/api/graphs/{graph_id}/unpacking": {
        post: EditorOperations["lookAtUnpacking"];
    };
    "/api/graphs/{graph_id}/uses": {
        post: EditorOperations["callUses"];
    };
    "/api/graphs/{graph_id}/drafts": {
        get: EditorOperations["listDrafts"];
        post: EditorOperations["makeDraft"];
    };
    "/api/drafts/{draft_id}": {
        get: EditorOperations["getDraft"];
    };
    "/api/drafts/{draft_id}/proposal": {
        post: EditorOperations["proposeDraft"];
        delete: EditorOperations["withdrawProposal"];
    };
    "/api/drafts/{draft_id}/answers": {
        post: EditorOperations["answerProposal"];
    };
    "/api/drafts/{draft_id}/preview": {
        post: EditorOperations["previewMerge"];
    };
    "/api/drafts/{draft_id}/merge": {
        post: EditorOperations["mergeDraft"];
    };
    "/api/pieces": {
        post: EditorOperations["readPieces"];
    };
    "/api/graphs/{graph_id}/rehearsal": {
        post: EditorOperations["rehearse"];
    };
    "/api/graphs/{graph_id}/packages": {
        get: EditorOperations["listPackages"];
    };
    "/api/graphs/{graph_id}/packages/{package}": {
        get: EditorOperations["getPackage"];
    };
    "/api/graphs/{graph_id}/packages.zip": {
        get: EditorOperations["downloadPackages"];
    };
    "/api/values-package.zip": {
        get: EditorOperations["downloadValuesPackage"];
    };
    "/api/actions": {
        get: EditorOperations["listActions"];
        post: EditorOperations["createAction"];
    };
    "/api/actions/graphs": {
        get: EditorOperations["listGraphsAsActions"];
    };
    "/api/actions/deleted": {
        get: EditorOperations["listDeletedActions"];
    };
    "/api/actions/{action_id}/umrf": {
        get: EditorOperations["getActionUmrf"];
        put: EditorOperations["replaceAction"];
        post: EditorOperations["compareWithFile"];
    };
    "/api/actions/{action_id}/uses": {
        get: EditorOperations["listUses"];
        post: EditorOperations["updateUses"];
    };
    "/api/actions/{action_id}/take": {
        post: EditorOperations["takeOver"];
    };
    "/api/actions/{action_id}/build": {
        get: EditorOperations["getBuild"];
        put: EditorOperations["putBuild"];
    };
    "/api/audit": {
        get: EditorOperations["listAudit"];
    };
    "/api/audit/kept": {
        post: EditorOperations["keepAudit"];
    };
    "/api/notifications": {
        get: EditorOperations["listReceivers"];
    };
    "/api/notifications/{name}/test": {
        post: EditorOperations["testReceiver"];
    };
    "/api/devices": {
        get: EditorOperations["listDevices"];
    };
    "/api/devices/{session}/end": {
        post: EditorOperations["endDevice"];
    };
    "/api/devices/end": {
        post: EditorOperations["endOtherDevices"];
    };
    "/api/devices/codes": {
        post: EditorOperations["makeDeviceCode"];
    };
    "/api/devices/codes/{code}": {
        get: EditorOperations["lookAtDevice"];
        delete: EditorOperations["cancelDeviceCode"];
    };
    "/api/devices/codes/{code}/answer": {
        post: EditorOperations["answerDevice"];
    };
    "/api/devices/codes/{code}/qr": {
        get: EditorOperations["getDeviceQrCode"];
    };
    "/api/confirmations/mine": {
        get: EditorOperations["getConfirmation"];
    };
    "/api/confirmations/records": {
        post: EditorOperations["adoptConfirmation"];
    };
    "/api/passkeys": {
        get: EditorOperations["listPasskeys"];
        post: EditorOperations["registerPasskey"];
    };
    "/api/passkeys/challenge": {
        post: EditorOperations["beginPasskey"];
    };
    "/api/passkeys/{passkey}": {
        delete: EditorOperations["removePasskey"];
        patch: EditorOperations["renamePasskey"];
    };
    "/api/passkeys/confirm/challenge": {
        post: EditorOperations["beginPasskeyConfirmation"];
    };
    "/api/passkeys/confirm": {
        post: EditorOperations["confirmByPasskey"];
    };
    "/api/passkeys/ask-again": {
        put: EditorOperations["setOwnerAsked"];
    };
    "/api/tokens": {
        get: EditorOperations["listTokens"];
        post: EditorOperations["makeToken"];
    };
    "/api/tokens/{token}/revoke": {
        post: EditorOperations["revokeToken"];
    };
    "/api/logins": {
        post: EditorOperations["beginLogin"];
    };
    "/api/logins/claim": {
        post: EditorOperations["claimLogin"];
    };
    "/api/logins/cancel": {
        post: EditorOperations["cancelLogin"];
    };
    "/api/logins/look": {
        post: EditorOperations["lookAtLogin"];
    };
    "/api/logins/confirm": {
        post: EditorOperations["confirmLogin"];
    };
    "/api/logins/refuse": {
        post: EditorOperations["refuseLogin"];
    };
    "/api/view": {
        get: EditorOperations["getViewPlaces"];
    };
    "/api/view/graph": {
        get: EditorOperations["viewGraph"];
    };
    "/api/view/graph/events": {
        get: EditorOperations["followViewedGraph"];
    };
    "/api/view-links": {
        get: EditorOperations["listViewLinks"];
        post: EditorOperations["makeViewLink"];
    };
    "/api/view-links/{link}/revoke": {
        post: EditorOperations["revokeViewLink"];
    };
    "/api/doctor": {
        get: EditorOperations["examine"];
    };
    "/api/doctor/last": {
        get: EditorOperations["getLastExamination"];
    };
    "/healthz": {
        get: EditorOperations["getHealth"];
    };
    "/readyz": {
        get: EditorOperations["getReadiness"];
    };
    "/metrics": {
        get: EditorOperations["getMetrics"];
    };
    "/api/status": {
        get: EditorOperations["getStatus"];
    };
    "/api/server": {
        get: EditorOperations["proveServer"];
    };
}

interface EditorOperations {
    getSession: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["SignedIn"];
                };
            };
        };
    };
    signIn: {
        requestBody: {
            content: {
                "application/json": EditorApi["SignIn"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["SignedIn"];
                };
            };
        };
    };
    signOut: {
        responses: {
            204: {
            };
        };
    };
    lookAtInvitation: {
        requestBody: {
            content: {
                "application/json": EditorApi["InvitationQuestion"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Invited"];
                };
            };
        };
    };
    sendDeviceCode: {
        requestBody: {
            content: {
                "application/json": EditorApi["CodeOfDevice"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["WaitingDevice"];
                };
            };
        };
    };
    collectDevice: {
        requestBody: {
            content: {
                "application/json": EditorApi["ClaimOfDevice"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["DeviceAnswer"];
                };
            };
        };
    };
    getProvider: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["ProviderOffer"];
                };
            };
        };
    };
    beginProvider: {
        requestBody: {
            content: {
                "application/json": EditorApi["ProviderBegin"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["ProviderVisit"];
                };
            };
        };
    };
    answerProvider: {
        requestBody: {
            content: {
                "application/json": EditorApi["ProviderAnswer"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["ProviderResult"];
                };
            };
        };
    };
    listInvitations: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Sharing"];
                };
            };
        };
    };
    invite: {
        requestBody: {
            content: {
                "application/json": EditorApi["Inviting"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": EditorApi["Invitation"];
                };
            };
        };
    };
    revokeInvitation: {
        parameters: {
            path: {
                invitation: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Invitation"];
                };
            };
        };
    };
    getInvitationCode: {
        parameters: {
            query: {
                origin: string;
            };
            path: {
                invitation: string;
            };
        };
        responses: {
            200: {
                content: {
                    "image/svg+xml": string;
                };
            };
        };
    };
    listSessions: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["OpenSession"][];
                };
            };
        };
    };
    endSession: {
        parameters: {
            path: {
                session: string;
            };
        };
        responses: {
            204: {
            };
        };
    };
    listMembers: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Members"];
                };
            };
        };
    };
    addMember: {
        requestBody: {
            content: {
                "application/json": EditorApi["NewMember"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": EditorApi["Member"];
                };
            };
        };
    };
    changeMember: {
        parameters: {
            path: {
                person: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["MemberChange"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Member"];
                };
            };
        };
    };
    linkMember: {
        parameters: {
            path: {
                person: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["NewLink"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Member"];
                };
            };
        };
    };
    getMemberCode: {
        parameters: {
            query: {
                origin: string;
            };
            path: {
                person: string;
            };
        };
        responses: {
            200: {
                content: {
                    "image/svg+xml": string;
                };
            };
        };
    };
    endMember: {
        parameters: {
            path: {
                person: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Member"];
                };
            };
        };
    };
    endSessionsOf: {
        parameters: {
            path: {
                person: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["EndedSessions"];
                };
            };
        };
    };
    makeGroup: {
        requestBody: {
            content: {
                "application/json": EditorApi["GroupName"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": EditorApi["Group"];
                };
            };
        };
    };
    removeGroup: {
        parameters: {
            path: {
                group: string;
            };
        };
        responses: {
            204: {
            };
        };
    };
    renameGroup: {
        parameters: {
            path: {
                group: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["GroupName"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Group"];
                };
            };
        };
    };
    getConfig: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Config"];
                };
            };
        };
    };
    listPeople: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Participant"][];
                };
            };
        };
    };
    listExamples: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Example"][];
                };
            };
        };
    };
    followEvents: {
        parameters: {
            query?: {
                after?: string | null;
            };
        };
        responses: {
            200: {
                content: {
                    "text/event-stream": EditorApi["StoredEvent"];
                };
            };
        };
    };
    listGraphs: {
        parameters: {
            query?: {
                deleted?: boolean;
                limit?: number | null;
                offset?: number;
                sort?: "changed" | "name" | "problems" | "size";
                q?: string;
                folder?: string | null;
                deep?: boolean;
                label?: string | null;
                first?: string[] | null;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["GraphView"][];
                };
            };
        };
    };
    createGraph: {
        parameters: {
            query?: {
                preview?: boolean;
                folder?: string | null;
                copy_of?: string | null;
            };
        };
        requestBody: {
            content: {
                "application/json": {
                    [key: string]: unknown;
                };
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Preview"];
                };
            };
            201: {
                content: {
                    "application/json": EditorApi["MadeGraph"];
                };
            };
        };
    };
    listGraphNames: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["GraphName"][];
                };
            };
        };
    };
    listGraphLabels: {
        parameters: {
            query?: {
                folder?: string | null;
                deep?: boolean;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["LabelCount"][];
                };
            };
        };
    };
    listThumbnails: {
        parameters: {
            query: {
                of: string[];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["ThumbnailOf"][];
                };
            };
        };
    };
    getGraph: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["GraphView"];
                };
            };
        };
    };
    deleteGraph: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        responses: {
            204: {
            };
        };
    };
    describeGraph: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["Describing"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["GraphView"];
                };
            };
        };
    };
    recoverGraph: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["GraphView"];
                };
            };
        };
    };
    getUmrf: {
        parameters: {
            query?: {
                at?: number | null;
                identities?: boolean;
            };
            path: {
                graph_id: string;
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
    putUmrf: {
        parameters: {
            query: {
                seq: number;
            };
            path: {
                graph_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": {
                    [key: string]: unknown;
                };
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["MergedGraph"];
                };
            };
        };
    };
    getProblems: {
        parameters: {
            query?: {
                seq?: number | null;
            };
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Problems"];
                };
            };
        };
    };
    getBreakpoints: {
        parameters: {
            query?: {
                at?: number | null;
                inside?: boolean;
            };
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Breakpoint"][];
                };
            };
        };
    };
    getRewriting: {
        parameters: {
            query: {
                seq: number;
            };
            path: {
                graph_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": {
                    [key: string]: unknown;
                };
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["TextEdit"];
                };
            };
        };
    };
    listFolders: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Folder"][];
                };
            };
        };
    };
    makeFolder: {
        requestBody: {
            content: {
                "application/json": EditorApi["NewFolder"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": EditorApi["Folder"];
                };
            };
        };
    };
    removeFolder: {
        parameters: {
            path: {
                folder_id: string;
            };
        };
        responses: {
            204: {
            };
        };
    };
    renameFolder: {
        parameters: {
            path: {
                folder_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["RenamingFolder"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Folder"];
                };
            };
        };
    };
    moveFolder: {
        parameters: {
            path: {
                folder_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["MovingFolder"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Folder"];
                };
            };
        };
    };
    fileGraph: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["Filing"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["GraphView"];
                };
            };
        };
    };
    getGraphRule: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["RuleView"];
                };
            };
        };
    };
    putGraphRule: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["Ruling"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["RuleView"];
                };
            };
        };
    };
    getFolderRule: {
        parameters: {
            path: {
                folder_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["RuleView"];
                };
            };
        };
    };
    putFolderRule: {
        parameters: {
            path: {
                folder_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["Ruling"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["RuleView"];
                };
            };
        };
    };
    getGraphRules: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Statement"];
                };
            };
        };
    };
    getHistory: {
        parameters: {
            query?: {
                limit?: number;
                before?: number | null;
            };
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["HistoryEntry"][];
                };
            };
        };
    };
    getDocument: {
        parameters: {
            query: {
                at: number;
            };
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["PastDocument"];
                };
            };
        };
    };
    getChanges: {
        parameters: {
            query: {
                after: number;
                upto: number;
                limit?: number;
            };
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["DocumentStep"][];
                };
            };
        };
    };
    getDifference: {
        parameters: {
            query: {
                from: number;
                to?: number | null;
            };
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Difference"];
                };
            };
        };
    };
    getBlame: {
        parameters: {
            query: {
                of: string;
                at?: number | null;
            };
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["FieldBlame"][];
                };
            };
        };
    };
    getValues: {
        parameters: {
            query: {
                of: string;
                field: string;
                at?: number | null;
            };
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["FieldValue"][];
                };
            };
        };
    };
    getSince: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["AskingSince"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["SinceWhen"];
                };
            };
        };
    };
    restoreGraph: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["Restoring"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["GraphView"];
                };
            };
        };
    };
    revertGraph: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["EditsOfOne"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["GoneBack"];
                };
            };
        };
    };
    listMentions: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Inbox"];
                };
            };
        };
    };
    readMentions: {
        requestBody: {
            content: {
                "application/json": EditorApi["ReadMentions"];
            };
        };
        responses: {
            204: {
            };
        };
    };
    listVersions: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["VersionView"][];
                };
            };
        };
    };
    publishVersion: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        requestBody?: {
            content: {
                "application/json": EditorApi["Publishing"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["VersionView"];
                };
            };
            201: {
                content: {
                    "application/json": EditorApi["VersionView"];
                };
            };
        };
    };
    getSubgraphs: {
        parameters: {
            query?: {
                at?: number | null;
            };
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["InsideView"];
                };
            };
        };
    };
    makeSubGraph: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["Extracting"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": EditorApi["MadeSubGraph"];
                };
            };
        };
    };
    downloadSubgraphs: {
        parameters: {
            query?: {
                at?: number | null;
            };
            path: {
                graph_id: string;
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
    getVersion: {
        parameters: {
            path: {
                version_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["VersionView"];
                };
            };
        };
    };
    getVersionBreakpoints: {
        parameters: {
            path: {
                version_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Breakpoint"][];
                };
            };
        };
    };
    getSight: {
        parameters: {
            path: {
                version_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Sight"];
                };
            };
        };
    };
    releaseVersion: {
        parameters: {
            path: {
                version_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["VersionView"];
                };
            };
        };
    };
    withdrawRelease: {
        parameters: {
            path: {
                version_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["VersionView"];
                };
            };
        };
    };
    getFlatGraph: {
        parameters: {
            query?: {
                at?: number | null;
            };
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["FlatGraph"];
                };
            };
        };
    };
    makeFlatGraph: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["FlatCopy"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": EditorApi["GraphView"];
                };
            };
        };
    };
    lookAtExtraction: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["Extracting"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["ExtractionLook"];
                };
            };
        };
    };
    lookAtUnpacking: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["UnpackingAction"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["UnpackingLook"];
                };
            };
        };
    };
    callUses: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["CallingUses"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["CalledUses"];
                };
            };
        };
    };
    listDrafts: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["DraftView"][];
                };
            };
        };
    };
    makeDraft: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        requestBody?: {
            content: {
                "application/json": EditorApi["NewDraft"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": EditorApi["DraftView"];
                };
            };
        };
    };
    getDraft: {
        parameters: {
            path: {
                draft_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["DraftView"];
                };
            };
        };
    };
    proposeDraft: {
        parameters: {
            path: {
                draft_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["Proposing"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["DraftView"];
                };
            };
        };
    };
    withdrawProposal: {
        parameters: {
            path: {
                draft_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["DraftView"];
                };
            };
        };
    };
    answerProposal: {
        parameters: {
            path: {
                draft_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["Answering"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["DraftView"];
                };
            };
        };
    };
    previewMerge: {
        parameters: {
            path: {
                draft_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["AskedMerge"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["MergePreview"];
                };
            };
        };
    };
    mergeDraft: {
        parameters: {
            path: {
                draft_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["WantedMerge"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["MergedDraft"];
                };
            };
        };
    };
    readPieces: {
        requestBody: {
            content: {
                "application/json": {
                    [key: string]: unknown;
                };
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Pieces"];
                };
            };
        };
    };
    rehearse: {
        parameters: {
            path: {
                graph_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["Rehearsing"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Rehearsal"];
                };
            };
        };
    };
    listPackages: {
        parameters: {
            query?: {
                at?: number | null;
            };
            path: {
                graph_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["PackageList"];
                };
            };
        };
    };
    getPackage: {
        parameters: {
            query?: {
                at?: number | null;
            };
            path: {
                graph_id: string;
                package: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["PackageContents"];
                };
            };
        };
    };
    downloadPackages: {
        parameters: {
            query?: {
                at?: number | null;
                package?: string[] | null;
            };
            path: {
                graph_id: string;
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
    downloadValuesPackage: {
        responses: {
            200: {
                content: {
                    "application/zip": string;
                };
            };
        };
    };
    listActions: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["LibraryAction"][];
                };
            };
        };
    };
    createAction: {
        parameters: {
            query?: {
                preview?: boolean;
            };
        };
        requestBody: {
            content: {
                "application/json": {
                    [key: string]: unknown;
                };
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Preview"];
                };
            };
            201: {
                content: {
                    "application/json": EditorApi["MadeGraph"];
                };
            };
        };
    };
    listGraphsAsActions: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["GraphAsAction"][];
                };
            };
        };
    };
    listDeletedActions: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["GraphView"][];
                };
            };
        };
    };
    getActionUmrf: {
        parameters: {
            query?: {
                at?: number | null;
            };
            path: {
                action_id: string;
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
    replaceAction: {
        parameters: {
            query?: {
                seq?: number | null;
            };
            path: {
                action_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": {
                    [key: string]: unknown;
                };
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["GraphView"];
                };
            };
        };
    };
    compareWithFile: {
        parameters: {
            path: {
                action_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": {
                    [key: string]: unknown;
                };
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Difference"];
                };
            };
        };
    };
    listUses: {
        parameters: {
            query?: {
                inputs?: string[] | null;
                outputs?: string[] | null;
            };
            path: {
                action_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["ActionUses"];
                };
            };
        };
    };
    updateUses: {
        parameters: {
            path: {
                action_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["UpdatingUses"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["UpdatedGraph"][];
                };
            };
        };
    };
    takeOver: {
        parameters: {
            path: {
                action_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["TakingOver"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["GraphView"];
                };
            };
        };
    };
    getBuild: {
        parameters: {
            path: {
                action_id: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["LastBuild"];
                };
            };
        };
    };
    putBuild: {
        parameters: {
            path: {
                action_id: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["BuildReport"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["LastBuild"];
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
                    "application/json": EditorApi["AuditPage"];
                };
            };
        };
    };
    keepAudit: {
        requestBody: {
            content: {
                "application/json": EditorApi["KeptAudit"];
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
                    "application/json": EditorApi["ReceiverState"][];
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
                    "application/json": EditorApi["ReceiverState"];
                };
            };
        };
    };
    listDevices: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["OwnDevices"];
                };
            };
        };
    };
    endDevice: {
        parameters: {
            path: {
                session: string;
            };
        };
        responses: {
            204: {
            };
        };
    };
    endOtherDevices: {
        responses: {
            204: {
            };
        };
    };
    makeDeviceCode: {
        responses: {
            201: {
                content: {
                    "application/json": EditorApi["DeviceCode"];
                };
            };
        };
    };
    lookAtDevice: {
        parameters: {
            path: {
                code: string;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["DeviceAsking"];
                };
            };
        };
    };
    cancelDeviceCode: {
        parameters: {
            path: {
                code: string;
            };
        };
        responses: {
            204: {
            };
        };
    };
    answerDevice: {
        parameters: {
            path: {
                code: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["DeviceIsMine"];
            };
        };
        responses: {
            204: {
            };
        };
    };
    getDeviceQrCode: {
        parameters: {
            query: {
                origin: string;
            };
            path: {
                code: string;
            };
        };
        responses: {
            200: {
                content: {
                    "image/svg+xml": string;
                };
            };
        };
    };
    getConfirmation: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["OwnConfirmation"];
                };
            };
        };
    };
    adoptConfirmation: {
        requestBody: {
            content: {
                "application/json": EditorApi["Confirmation"];
            };
        };
        responses: {
            204: {
            };
        };
    };
    listPasskeys: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["OwnPasskeys"];
                };
            };
        };
    };
    registerPasskey: {
        requestBody: {
            content: {
                "application/json": EditorApi["NewPasskey"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": EditorApi["PasskeyShown"];
                };
            };
        };
    };
    beginPasskey: {
        responses: {
            201: {
                content: {
                    "application/json": EditorApi["PasskeyOptions"];
                };
            };
        };
    };
    removePasskey: {
        parameters: {
            path: {
                passkey: string;
            };
        };
        responses: {
            204: {
            };
        };
    };
    renamePasskey: {
        parameters: {
            path: {
                passkey: string;
            };
        };
        requestBody: {
            content: {
                "application/json": EditorApi["PasskeyName"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["PasskeyShown"];
                };
            };
        };
    };
    beginPasskeyConfirmation: {
        responses: {
            201: {
                content: {
                    "application/json": EditorApi["PasskeyOptions"];
                };
            };
        };
    };
    confirmByPasskey: {
        requestBody: {
            content: {
                "application/json": EditorApi["PasskeyProof"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Confirmation"];
                };
            };
        };
    };
    setOwnerAsked: {
        requestBody: {
            content: {
                "application/json": EditorApi["OwnerAsked"];
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
                    "application/json": EditorApi["TokenList"];
                };
            };
        };
    };
    makeToken: {
        requestBody: {
            content: {
                "application/json": EditorApi["MakeToken"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": EditorApi["MadeToken"];
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
    beginLogin: {
        requestBody: {
            content: {
                "application/json": EditorApi["BeginLogin"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["LoginBegun"];
                };
            };
        };
    };
    claimLogin: {
        requestBody: {
            content: {
                "application/json": EditorApi["LoginSecret"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Claimed"];
                };
            };
        };
    };
    cancelLogin: {
        requestBody: {
            content: {
                "application/json": EditorApi["LoginSecret"];
            };
        };
        responses: {
            204: {
            };
        };
    };
    lookAtLogin: {
        requestBody: {
            content: {
                "application/json": EditorApi["LoginCode"];
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["LoginRequest"];
                };
            };
        };
    };
    confirmLogin: {
        requestBody: {
            content: {
                "application/json": EditorApi["ConfirmLogin"];
            };
        };
        responses: {
            204: {
            };
        };
    };
    refuseLogin: {
        requestBody: {
            content: {
                "application/json": EditorApi["LoginCode"];
            };
        };
        responses: {
            204: {
            };
        };
    };
    getViewPlaces: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["ViewPlaces"];
                };
            };
        };
    };
    viewGraph: {
        parameters: {
            query?: {
                again?: boolean;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["SharedGraph"];
                };
            };
        };
    };
    followViewedGraph: {
        responses: {
            200: {
                content: {
                    "text/event-stream": EditorApi["SharedGraphChanged"];
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
                    "application/json": EditorApi["ViewLink"][];
                };
            };
        };
    };
    makeViewLink: {
        requestBody: {
            content: {
                "application/json": EditorApi["NewViewLink"];
            };
        };
        responses: {
            201: {
                content: {
                    "application/json": EditorApi["ViewLink"];
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
    examine: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Diagnostic"][];
                };
            };
        };
    };
    getLastExamination: {
        parameters: {
            query?: {
                look?: boolean;
            };
        };
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["LastExamination"];
                };
            };
        };
    };
    getHealth: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Health"];
                };
            };
        };
    };
    getReadiness: {
        responses: {
            200: {
                content: {
                    "application/json": EditorApi["Readiness"];
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
                    "application/json": EditorApi["ProcessStatus"];
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
                    "application/json": EditorApi["ServerProof"];
                };
            };
        };
    };
}
