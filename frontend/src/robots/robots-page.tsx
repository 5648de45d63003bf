/** Robots: how their engines are, what runs there, who else is at it, and how to add one. */
import { Button, Code, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconPlus, IconRadar2, IconRobot } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { Fragment, useState } from "react";
import { Link } from "wouter";
import { errorText, runnerWords } from "../api/http";
import type { SiteState } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { useMay } from "../api/people";
import {
  type FoundEngine,
  PRACTICE,
  type Registration,
  startPracticeRobot,
  useFoundEngines,
  useRosReach,
} from "../api/robots";
import type { Site } from "../api/sites";
import { Empty } from "../ui/empty";
import { lazyPart, OverlayBoundary } from "../ui/lazy-part";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import { RobotCard } from "./robot-card";
import type { EditedRobot } from "./robot-form";
import style from "./robots-page.module.css";

const RobotForm = lazyPart(() => import("./robot-form").then((part) => part.RobotForm));

const NEW: Registration = {
  name: "",
  domain: 0,
  rmw: "",
  get_service: "umrf_graph_get",
  profile: {},
  led: false,
};

interface Props {
  /** Makes a graph of what a robot runs or was told. */
  onImport: (text: string, name: string) => void;
}

function PracticeButton({ runner, again = false }: { runner: string; again?: boolean }) {
  const client = useQueryClient();
  const start = useMutation({
    mutationFn: () => startPracticeRobot(runner),
    onError: (error) => notifications.show({ color: "red", message: errorText(error) }),
    onSettled: () => client.invalidateQueries({ queryKey: ["robots", "reach"] }),
  });
  return (
    <Button
      variant="default"
      leftSection={<IconRobot size={16} aria-hidden />}
      loading={start.isPending}
      title="Starts an emulated robot on the runner’s computer; it moves nothing"
      onClick={() => start.mutate()}
    >
      {again ? "Start the practice robot again" : "Practice robot"}
    </Button>
  );
}

/** Says why the practice robot of a runner is gone, and starts it again there. */
function PracticeEnded({ runner }: { runner: string }) {
  if (useRosReach(runner).data?.no_reach !== "") return null;
  return (
    <div className="row-wrap gap-50">
      <PracticeButton runner={runner} again />
      <span className="quiet-xs">It ended with its runner. It moves nothing.</span>
    </div>
  );
}

function NoReach({ why }: { why: string }) {
  return (
    <p className={style.reach} role="status">
      <b>No robot can be reached from here.</b> {why} <Code>action-assistant doctor</Code> says what
      is missing.
    </p>
  );
}

function SiteHead({ site, state }: SiteState) {
  const reach = useRosReach(site.url).data;
  return (
    <>
      <h3 className={style.foundEnginesTitle}>{site.name}</h3>
      {state.link === "down" && (
        <p className={style.reach} role="status">
          <b>{runnerWords(site.name)} does not answer.</b> What its robots do is not known.
        </p>
      )}
      {state.link === "live" && reach?.no_reach && <NoReach why={reach.no_reach} />}
    </>
  );
}

export function RobotsPage({ onImport }: Props) {
  const { runner, now } = useLive();
  const may = useMay("register");
  const queued = now.queue?.number ?? 0;
  const reach = useRosReach(runner).data;
  const [editing, setEditing] = useState<EditedRobot | null>(null);
  const known = now.link !== "connecting" || reach !== undefined;
  const engines = now.engines.length > 0 ? now.engines : (reach?.engines ?? []);
  const robots = engines.filter((robot) => !robot.simulated);
  const take = (candidate: FoundEngine, at: string) => {
    const { actor: name, domain, get_service } = candidate;
    setEditing({ robot: { ...NEW, name, domain, get_service }, isNew: true, at });
  };
  const isPractising = robots.some(({ name }) => name === PRACTICE);
  const mayPractise = may && reach?.no_reach === "";
  const button = (
    <Button
      variant="filled"
      leftSection={<IconPlus size={16} aria-hidden />}
      disabled={!may}
      title={may ? undefined : "Operators register robots"}
      onClick={() => setEditing({ robot: NEW, isNew: true })}
    >
      Register a robot
    </Button>
  );
  const buttons = (
    <div className="row-wrap gap-50">
      {button}
      {mayPractise && !isPractising && runner !== undefined && <PracticeButton runner={runner} />}
    </div>
  );
  return (
    <main className="page">
      <div className={style.inner}>
        <div className={style.head}>
          <h2 className="page-title">Robots</h2>
          {robots.length > 0 && buttons}
        </div>
        {queued > 0 && (
          <p>
            <Link to="/runs/queue">{counted(queued, "start")} in the queue</Link>
          </p>
        )}
        {now.sites === undefined && reach?.no_reach && <NoReach why={reach.no_reach} />}
        {!known && (
          <div aria-hidden>
            {[0, 1].map((i) => (
              <Skeleton key={i} height={120} mb={12} radius="lg" />
            ))}
          </div>
        )}
        {known && robots.length === 0 && (
          <Empty icon={<IconRobot size={22} />} title="No robot yet" action={buttons}>
            Register the name of its TeMoto engine. Then everybody here sees its state and what runs
            on it, and can stop it.
            <p>A practice robot behaves like a real engine, and moves nothing.</p>
          </Empty>
        )}
        {(now.sites ?? [null]).map((at) => (
          <Fragment key={at?.site.url ?? ""}>
            {at && <SiteHead {...at} />}
            {robots
              .filter(
                ({ name }) => at === null || at.state.engines.some((its) => its.name === name),
              )
              .map((robot) => (
                <RobotCard
                  key={robot.name}
                  robot={robot}
                  onEdit={(robot) => setEditing({ robot, isNew: false })}
                  onImport={onImport}
                  restartControl={
                    may &&
                    runner !== undefined &&
                    robot.practice_ended &&
                    (at === null || (at.state.link === "live" && !at.site.isUnlisted)) && (
                      <PracticeEnded runner={at?.site.url ?? runner} />
                    )
                  }
                />
              ))}
          </Fragment>
        ))}
        {runner !== undefined &&
          (now.sites?.map(({ site }) => site) ?? [{ name: "", url: runner }])
            .filter(({ isUnlisted }) => !isUnlisted)
            .map((site) => <FoundEngines key={site.url} site={site} may={may} onTake={take} />)}
      </div>
      <OverlayBoundary>
        {editing && <RobotForm editing={editing} onClose={() => setEditing(null)} />}
      </OverlayBoundary>
    </main>
  );
}

interface FoundEnginesProps {
  /** Its name is "" with one runner. */
  site: Site;
  may: boolean;
  onTake: (candidate: FoundEngine, runner: string) => void;
}

function words(candidate: FoundEngine): string {
  if (candidate.problem !== "") return candidate.problem;
  if (candidate.generation === "older") return "speaks an older generation of messages";
  if (candidate.actor === "") return "an idle engine does not say its name: you have to know it";
  return "heard by its feedback";
}

/** Engines that the runner of a site has found, which is to lead them. */
function FoundEngines({ site, may, onTake }: FoundEnginesProps) {
  const reach = useRosReach(site.url).data;
  const { data } = useFoundEngines(site.url, reach?.no_reach === "");
  const found = data?.engines ?? [];
  const looking = (data?.left_s ?? 0) > 0;
  if (found.length === 0 && !looking) return null;
  const where = site.name === "" ? "" : ` of ${isolated(site.name)}`;
  const title = `In sight${where}, not registered`;
  return (
    <section className={style.section} aria-label={title}>
      <h3 className={style.foundEnginesTitle}>
        <IconRadar2 size={16} aria-hidden /> {title}
      </h3>
      {looking && (
        <p className="quiet-xs" role="status">
          Looking for engines; more may be found for another {Math.ceil(data?.left_s ?? 0)} s.
        </p>
      )}
      <ul className={style.list}>
        {found.map((each) => (
          <li key={`${each.domain} ${each.get_service}`} className={style.line}>
            <b>{each.actor || "An engine"}</b>
            <span className="quiet-xs">
              domain {each.domain} · {each.get_service} · {words(each)}
            </span>
            <span className="flex-1" />
            <Button size="compact-sm" disabled={!may} onClick={() => onTake(each, site.url)}>
              Register{each.actor === "" ? " …" : ""}
            </Button>
          </li>
        ))}
      </ul>
    </section>
  );
}
