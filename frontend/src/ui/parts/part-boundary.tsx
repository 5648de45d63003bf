/** Around a part that is loaded late: says that it loads, and what to do when it does not arrive. */
import { Button, Loader } from "@mantine/core";
import { IconPlugConnectedX } from "@tabler/icons-react";
import { Component, type ReactNode, Suspense } from "react";
import { Empty } from "../empty";
import { PartMissing } from "./lazy-part";
import style from "./part-boundary.module.css";

/** Nothing at first, so that what comes at once does not flicker; progress after a second. */
function Loading() {
  return (
    <div className={style.loading} role="status" aria-busy>
      <Loader size="sm" type="dots" aria-hidden />
      <span>Loading …</span>
    </div>
  );
}

function Missing() {
  return (
    <div role="alert">
      <Empty
        icon={<IconPlugConnectedX size={22} />}
        title="This part of the page did not arrive"
        action={
          <Button variant="filled" onClick={() => location.reload()}>
            Reload the page
          </Button>
        }
      >
        The server does not answer, or it was updated while this page was open. What you changed and
        is not saved yet waits on this device; where it cannot, the browser asks before it reloads.
      </Empty>
    </div>
  );
}

interface Props {
  children: ReactNode;
  /** What stands around the notices where the part brings its own surroundings. */
  frame?: (notice: ReactNode) => ReactNode;
  /** Instead of `Loading`. */
  waiting?: ReactNode;
}

export class PartBoundary extends Component<Props, { error: unknown }> {
  override state = { error: null };

  static getDerivedStateFromError(error: unknown): { error: unknown } {
    return { error };
  }

  override componentDidCatch(error: unknown): void {
    if (error instanceof PartMissing) error.forget();
  }

  override render(): ReactNode {
    const { children, frame = (notice: ReactNode) => notice, waiting = <Loading /> } = this.props;
    const error: unknown = this.state.error;
    if (error instanceof PartMissing) return frame(<Missing />);
    if (error !== null) throw error;
    return <Suspense fallback={frame(waiting)}>{children}</Suspense>;
  }
}

const over = (notice: ReactNode) => <div className={style.over}>{notice}</div>;

/** For what opens over the page: its notices stand in the middle of the screen. */
export function OverlayBoundary({ children }: { children: ReactNode }) {
  return <PartBoundary frame={over}>{children}</PartBoundary>;
}

/** For what opens at a button, which stays as it is until the part brings its own. */
export function OpeningBoundary({ button, children }: { button: ReactNode; children: ReactNode }) {
  const beside = (notice: ReactNode) => (
    <>
      {button}
      {over(notice)}
    </>
  );
  return <PartBoundary frame={beside}>{children}</PartBoundary>;
}
