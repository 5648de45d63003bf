/** The values with which a graph was last started. */
import { useQuery } from "@tanstack/react-query";
import { useLive } from "../api/page-link";
import { usePerson } from "../api/people";
import { fetchEarlierValues } from "../api/starts";

/** Query the values of the newest start of a graph, by this person if there is one. `asks`: it asks for some. */
export function useEarlierValues(graph: string, asks: boolean) {
  const { runner } = useLive();
  const { person } = usePerson();
  return useQuery({
    queryKey: ["runs", "values", graph, person.id],
    queryFn: ({ signal }) => fetchEarlierValues(runner ?? "", graph, person.id, signal),
    enabled: asks && runner !== undefined,
    staleTime: 0,
    gcTime: 0,
  });
}
