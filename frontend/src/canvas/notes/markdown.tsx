/**
 * Renders the Markdown of notes as React elements, never as HTML.
 *
 * It is loaded when the first note is shown. Notes may come from strangers: raw HTML stays text,
 * images become their alternative text, and only web and mail addresses become links.
 */
import type { Nodes } from "mdast";
import { fromMarkdown } from "mdast-util-from-markdown";
import { type ReactNode, useMemo } from "react";
import { linkPieces } from "../../graph/note-links";
import { ActionLink } from "./note-buttons";
import style from "./note-text.module.css";

/** Indented lines stay text, since notes were plain text before. */
const OPTIONS = {
  extensions: [{ disable: { null: ["htmlFlow", "htmlText", "codeIndented", "setextUnderline"] } }],
};
/** Texts with deeper nesting take seconds to parse, and are shown as plain text. */
const TOO_DEEP = /^[ \t]*(?:(?:>|(?:[-+*]|\d{1,9}[.)])[ \t])[ \t]*){20}/m;
const DEEPEST = 12; // levels of lists and quotations that are rendered
const ADDRESS = /https?:\/\/[^\s<>"'[\]]*[^\s<>"'[\].,;:!?)]/g;

/** Return the normalized address if it may be opened (http, https or mailto), else null. */
export function safeAddress(address: string): string | null {
  try {
    const { protocol, href } = new URL(address);
    return ["http:", "https:", "mailto:"].includes(protocol) ? href : null;
  } catch {
    return null;
  }
}

function OutsideLink({ to, children }: { to: string; children: ReactNode }) {
  const address = safeAddress(to);
  if (address === null) return children;
  return (
    <a className="nodrag" href={address} target="_blank" rel="noopener noreferrer" title={address}>
      {children}
    </a>
  );
}

/** Return a text with its web addresses as links. */
function addressed(text: string): ReactNode[] {
  const parts: ReactNode[] = [];
  let end = 0;
  for (const match of text.matchAll(ADDRESS)) {
    parts.push(text.slice(end, match.index));
    parts.push(
      <OutsideLink key={match.index} to={match[0]}>
        {match[0]}
      </OutsideLink>,
    );
    end = match.index + match[0].length;
  }
  parts.push(text.slice(end));
  return parts;
}

function words(text: string, inLink: boolean): ReactNode[] {
  return linkPieces(text).map((piece, i) => {
    if (typeof piece === "string") return inLink ? piece : addressed(piece);
    // biome-ignore lint/suspicious/noArrayIndexKey: pieces of a text have no other name than their place
    return inLink ? piece.name : <ActionLink key={i} link={piece} />;
  });
}

interface Around {
  readonly depth: number;
  readonly inLink: boolean;
}

function all(nodes: readonly Nodes[], around: Around): ReactNode[] {
  const inside = { ...around, depth: around.depth + 1 };
  if (inside.depth > DEEPEST) return ["…"];
  // biome-ignore lint/suspicious/noArrayIndexKey: the tree is made anew with each text
  return nodes.map((node, i) => <Part key={i} node={node} around={inside} />);
}

function Part({ node, around }: { node: Nodes; around: Around }): ReactNode {
  switch (node.type) {
    case "text":
      return words(node.value, around.inLink);
    case "paragraph":
      return <p>{all(node.children, around)}</p>;
    case "heading":
      // no heading element: headings of the page have an order of their own
      return <p data-heading={node.depth}>{all(node.children, around)}</p>;
    case "strong":
      return <strong>{all(node.children, around)}</strong>;
    case "emphasis":
      return <em>{all(node.children, around)}</em>;
    case "inlineCode":
      return <code>{node.value}</code>;
    case "code":
      return <pre>{node.value}</pre>;
    case "break":
      return <br />;
    case "thematicBreak":
      return <hr />;
    case "blockquote":
      return <blockquote>{all(node.children, around)}</blockquote>;
    case "list":
      return node.ordered ? (
        <ol start={node.start ?? 1}>{all(node.children, around)}</ol>
      ) : (
        <ul>{all(node.children, around)}</ul>
      );
    case "listItem":
      return <li>{all(node.children, around)}</li>;
    case "link":
      return (
        <OutsideLink to={node.url}>{all(node.children, { ...around, inLink: true })}</OutsideLink>
      );
    case "image":
    case "imageReference":
      return node.alt ?? "";
    case "linkReference":
      return all(node.children, around);
    case "html":
      return node.value;
    default:
      return null;
  }
}

export default function Markdown({ text }: { text: string }) {
  const tree = useMemo(() => (TOO_DEEP.test(text) ? null : fromMarkdown(text, OPTIONS)), [text]);
  if (tree === null) return <p className={style.plain}>{text}</p>;
  return <div className={style.markdown}>{all(tree.children, { depth: 0, inLink: false })}</div>;
}
