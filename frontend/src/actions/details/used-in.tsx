/** The graphs that use an action; those whose use has other parameters are told. */
import { Button } from "@mantine/core";
import { Link } from "wouter";
import { useGraphs } from "../../api/graphs";
import { isolated } from "../../words/isolated";
import style from "./details.module.css";

interface Props {
  usedIn: readonly string[];
  /** Of them, those with other parameters. */
  differs: readonly string[];
  /** Makes the action what a graph has; absent where that cannot be done. */
  onTake?: (graph: string, name: string) => void;
}

export function UsedIn({ usedIn, differs, onTake }: Props) {
  const graphs = useGraphs().data ?? [];
  const nameOf = (id: string) => graphs.find((graph) => graph.id === id)?.name || "Untitled";
  return (
    <section>
      <h3 className={style.heading}>
        Used in
        {usedIn.length > 0 && (
          <span>{usedIn.length === 1 ? "1 graph" : `${usedIn.length} graphs`}</span>
        )}
      </h3>
      {usedIn.length === 0 && <p className={style.quiet}>No graph uses it yet.</p>}
      <ul className={style.facts} aria-label="Graphs that use it">
        {usedIn.map((id) => (
          <li key={id}>
            <Link to={`/graphs/${id}`} className={style.link}>
              <bdi>{nameOf(id)}</bdi>
            </Link>
            {differs.includes(id) && (
              <span className={style.differs}>
                older parameters
                {onTake && (
                  <Button size="compact-sm" variant="subtle" onClick={() => onTake(id, nameOf(id))}>
                    Take over
                    <span className="visually-hidden"> what {isolated(nameOf(id))} has</span>
                  </Button>
                )}
              </span>
            )}
          </li>
        ))}
      </ul>
    </section>
  );
}
