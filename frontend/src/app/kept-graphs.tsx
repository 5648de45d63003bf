/** The graphs that this device keeps: what there is to open while no server answers. */
import { useQuery } from "@tanstack/react-query";
import { Link } from "wouter";
import { usePerson } from "../api/people";
import { keptGraphs } from "../sync/kept-graphs";
import style from "./kept-graphs.module.css";

export function KeptGraphs() {
  const { person } = usePerson();
  const kept = useQuery({
    queryKey: ["kept", person.id],
    queryFn: () => keptGraphs(person.id),
    networkMode: "always",
    retry: false,
  });
  if (kept.data === undefined || kept.data.length === 0) return null;
  return (
    <section className={style.kept} aria-label="On this device">
      <h3>On this device</h3>
      <ul>
        {kept.data.map(({ graph, name, waiting, usedAt }) => (
          <li key={graph}>
            <Link to={`/graphs/${graph}`}>{name || "Untitled"}</Link>
            <span>
              {waiting > 0 && `${waiting === 1 ? "1 change waits" : `${waiting} changes wait`} · `}
              last seen here on{" "}
              {new Date(usedAt).toLocaleString([], { dateStyle: "medium", timeStyle: "short" })}
            </span>
          </li>
        ))}
      </ul>
    </section>
  );
}
