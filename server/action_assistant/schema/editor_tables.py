"""The editor's tables: its log, and what is folded from it."""

from typing import Final

from sqlalchemy import BigInteger, Column, Index, LargeBinary, MetaData, Table, Text

from action_assistant.schema.log_tables import NAMES, log_tables, outbox_tables, written_by_table

EDITOR: Final = MetaData(naming_convention=NAMES)
editor_event, editor_head, editor_snapshot = log_tables(EDITOR)
#: How often a stream has changed hands between several editors.
editor_head.append_column(Column("epoch", BigInteger, nullable=False, server_default="0"))
written_by: Final = written_by_table(EDITOR)
#: A graph of the catalogue, or an action of the library (`kind`). `name` and `description` follow the
#: document. A draft was made of the graph `draft_of` after its change `drafted_seq`; what both are compared
#: with is `base_graph` after its change `base_seq`; `merged_seq` is the change up to which the draft was
#: merged. `folder`: the folder in which the graph lies. `rule`: who may see and edit it, as JSON; none where
#: that of its folder counts.
graph: Final = Table(
    "graph",
    EDITOR,
    Column("id", Text, primary_key=True),
    Column("name", Text, nullable=False),
    Column("description", Text, nullable=False),
    Column("made_at", BigInteger, nullable=False),
    Column("made_by", Text, nullable=False),
    Column("deleted_at", BigInteger),
    Column("kind", Text, nullable=False, server_default="graph"),
    Column("draft_of", Text),
    Column("draft_name", Text),
    Column("base_graph", Text),
    Column("drafted_seq", BigInteger),
    Column("base_seq", BigInteger),
    Column("merged_seq", BigInteger),
    Column("folder", Text),
    Column("rule", Text),
    Index(None, "draft_of"),
)
#: A folder of graphs. `parent`: the folder in which it lies. `rule`: as of a graph.
folder: Final = Table(
    "folder",
    EDITOR,
    Column("id", Text, primary_key=True),
    Column("name", Text, nullable=False),
    Column("parent", Text),
    Column("made_at", BigInteger, nullable=False),
    Column("made_by", Text, nullable=False),
    Column("rule", Text),
)
#: A published version. Its UMRF stands in the body of the event `(stream, event_seq)`. An owner may have
#: released it.
version: Final = Table(
    "version",
    EDITOR,
    Column("id", Text, primary_key=True),
    Column("graph", Text, nullable=False),
    Column("label", Text, nullable=False),
    Column("digest", Text, nullable=False),
    Column("seq", BigInteger, nullable=False),
    Column("author_id", Text, nullable=False),
    Column("author_name", Text, nullable=False),
    Column("at", BigInteger, nullable=False),
    Column("stream", Text, nullable=False),
    Column("event_seq", BigInteger, nullable=False),
    Column("note", Text, nullable=False, server_default=""),
    Column("tree_digest", Text),
    Column("released_at", BigInteger),
    Column("released_by", Text),
    Column("released_by_name", Text),
    Index(None, "graph", "at"),
    Index(None, "digest"),
)
#: A person who acted here, under the last name that they gave.
person: Final = Table(
    "person",
    EDITOR,
    Column("id", Text, primary_key=True),
    Column("name", Text, nullable=False),
    Column("seen_at", BigInteger, nullable=False),
)
#: A link that lets people in with a role.
invitation: Final = Table(
    "invitation",
    EDITOR,
    Column("id", Text, primary_key=True),
    Column("role", Text, nullable=False),
    Column("label", Text, nullable=False),
    Column("made_at", BigInteger, nullable=False),
    Column("made_by", Text, nullable=False),
    Column("revoked_at", BigInteger),
    Column("revoked_by", Text),
)
#: The people who came in by each link: their name, and when they first came.
guest: Final = Table(
    "guest",
    EDITOR,
    Column("invitation", Text, primary_key=True),
    Column("person", Text, primary_key=True),
    Column("name", Text, nullable=False),
    Column("at", BigInteger, nullable=False),
)
#: Which keys each event of a document's log changed. `owner`: what a key speaks of. Values are MessagePack,
#: none where there is no such key. Derived some time after the events were stored, and again from them
#: whenever it is not there.
key_change: Final = Table(
    "key_change",
    EDITOR,
    Column("graph", Text, primary_key=True),
    Column("seq", BigInteger, primary_key=True, autoincrement=False),
    Column("root", Text, primary_key=True),
    Column("key", Text, primary_key=True),
    Column("owner", Text, nullable=False),
    Column("author", Text, nullable=False),
    Column("at", BigInteger, nullable=False),
    Column("before", LargeBinary),
    Column("after", LargeBinary),
    Index(None, "graph", "owner", "seq"),
    Index(None, "graph", "root", "key", "seq"),
)
#: The values that each event brought and that another value of their key overwrote at once: `stands`, none where
#: the key was deleted. Derived together with the changes of keys.
overwritten_value: Final = Table(
    "overwritten_value",
    EDITOR,
    Column("graph", Text, primary_key=True),
    Column("seq", BigInteger, primary_key=True, autoincrement=False),
    Column("root", Text, primary_key=True),
    Column("key", Text, primary_key=True),
    Column("author", Text, nullable=False),
    Column("at", BigInteger, nullable=False),
    Column("value", LargeBinary, nullable=False),
    Column("stands", LargeBinary),
)
#: Up to which event the changes of a graph are derived, and its document then, to go on from. `form`: what was
#: derived; none before overwritten values were.
key_change_head: Final = Table(
    "key_change_head",
    EDITOR,
    Column("graph", Text, primary_key=True),
    Column("seq", BigInteger, nullable=False),
    Column("document", LargeBinary, nullable=False),
    Column("form", BigInteger),
)
#: What lists show of each graph, as MessagePack (`Facts`), and by what they are sorted and searched. `form`: a
#: digest of the code that computed it. `seq`: the change, at `changed_at`, up to which the row is known to be right
#: if `form` is that of this program. `name_key`: `name` in the order of people. `words`: all texts that are searched, in
#: lower case. `worst`: the counts of problems as one number, `worst_alone` without the graphs inside. Computed again
#: from the document whenever it is not there.
graph_facts: Final = Table(
    "graph_facts",
    EDITOR,
    Column("graph", Text, primary_key=True),
    Column("form", LargeBinary, nullable=False),
    Column("facts", LargeBinary, nullable=False),
    Column("seq", BigInteger, nullable=False, server_default="0"),
    Column("changed_at", BigInteger, nullable=False, server_default="0"),
    Column("name", Text, nullable=False, server_default=""),
    Column("name_key", LargeBinary),
    Column("words", Text, nullable=False, server_default=""),
    Column("actions", BigInteger, nullable=False, server_default="0"),
    Column("worst", BigInteger, nullable=False, server_default="0"),
    Column("worst_alone", BigInteger, nullable=False, server_default="0"),
    Index(None, "changed_at"),
    Index(None, "name_key"),
)
#: The labels of each graph. Written together with its facts.
graph_label: Final = Table(
    "graph_label",
    EDITOR,
    Column("label", Text, primary_key=True),
    Column("graph", Text, primary_key=True),
    Index(None, "graph"),
)
#: A person for whom an owner has made a personal link, or who came by a provider. `groups`: ids of groups,
#: as JSON. `until`: when the right to do more than Stop ends. `provider`: as whom the provider knows them,
#: as JSON.
member: Final = Table(
    "member",
    EDITOR,
    Column("id", Text, primary_key=True),
    Column("name", Text, nullable=False),
    Column("role", Text, nullable=False),
    Column("groups", Text, nullable=False),
    Column("until", BigInteger),
    Column("made_at", BigInteger, nullable=False),
    Column("made_by", Text, nullable=False),
    Column("ended_at", BigInteger),
    Column("ended_by", Text),
    Column("provider", Text),
)
#: A personal link, which lets one browser in, once, before `expires`; and by which browser it was used.
personal_link: Final = Table(
    "personal_link",
    EDITOR,
    Column("id", Text, primary_key=True),
    Column("person", Text, nullable=False),
    Column("made_at", BigInteger, nullable=False),
    Column("made_by", Text, nullable=False),
    Column("expires", BigInteger, nullable=False),
    Column("used_at", BigInteger),
    Column("browser", Text),
    Column("address", Text),
    Column("withdrawn_at", BigInteger),
)
#: A group of persons.
people_group: Final = Table(
    "people_group",
    EDITOR,
    Column("id", Text, primary_key=True),
    Column("name", Text, nullable=False),
    Column("made_at", BigInteger, nullable=False),
    Column("made_by", Text, nullable=False),
)
#: A person was mentioned by `author` in the comment `key` of a graph, by its change `seq`. Derived from the
#: changes of keys some time after the event. A copy of a comment has its key, and is no mention of its own.
mention: Final = Table(
    "mention",
    EDITOR,
    Column("key", Text, primary_key=True),
    Column("person", Text, primary_key=True),
    Column("graph", Text, nullable=False),
    Column("seq", BigInteger, nullable=False),
    Column("author", Text, nullable=False),
    Column("at", BigInteger, nullable=False),
    Column("text", Text, nullable=False),
    Index(None, "person", "at"),
    Index(None, "graph", "key"),
)
#: Changes of graphs in which persons may be mentioned, which nobody has looked for yet.
mention_due: Final = Table(
    "mention_due",
    EDITOR,
    Column("graph", Text, primary_key=True),
    Column("seq", BigInteger, primary_key=True, autoincrement=False),
    Column("at", BigInteger, nullable=False),
)
#: The mentions that a person has read.
mention_read: Final = Table(
    "mention_read",
    EDITOR,
    Column("person", Text, primary_key=True),
    Column("key", Text, primary_key=True),
)
outbox, receiver = outbox_tables(EDITOR)
#: One of several editors that share this database, with the slot in which it writes. `life`: a random number of
#: its process. `url`: where it takes requests of other editors. `beat_at`: when it last said that it lives
#: (µs UTC, by the clock of the database); `draining_at`: since when it gives its rooms up; `proof`:
#: an HMAC that all editors with its token have; `mark`: the name of its file in the data folder; `met`: the
#: marks of others whose files it has found there.
editor: Final = Table(
    "editor",
    EDITOR,
    Column("slot", BigInteger, primary_key=True, autoincrement=False),
    Column("life", LargeBinary, nullable=False),
    Column("url", Text, nullable=False),
    Column("version", Text, nullable=False),
    Column("beat_at", BigInteger, nullable=False),
    Column("draining_at", BigInteger),
    Column("proof", LargeBinary),
    Column("mark", Text),
    Column("met", Text),
)
#: The editor that owns a stream, by its life, since it took the stream with this epoch. It only shows where to
#: ask; `head.epoch` says who may append. `people`: JSON of who is in the room, null for nobody.
room: Final = Table(
    "room",
    EDITOR,
    Column("stream", Text, primary_key=True),
    Column("life", LargeBinary, nullable=False),
    Column("epoch", BigInteger, nullable=False),
    Column("since", BigInteger, nullable=False),
    Column("people", Text),
    Index(None, "life"),
)
