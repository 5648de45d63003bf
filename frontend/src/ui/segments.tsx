/** Choice between a few words: radio buttons that look like one bar. */
import { type ReactNode, useId } from "react";
import style from "./segments.module.css";

interface Props<V extends string> {
  /** Read out. */
  label?: string;
  data: readonly { readonly value: V; readonly label: ReactNode }[];
  value: V;
  onChange: (value: V) => void;
  size?: "xs" | "sm";
  fullWidth?: boolean;
  disabled?: boolean;
  className?: string | undefined;
}

export function Segments<V extends string>(props: Props<V>) {
  const { label, data, value, onChange, size = "sm", fullWidth, disabled, className } = props;
  const name = useId();
  return (
    <div
      role="radiogroup"
      aria-label={label}
      className={`${style.bar} ${className ?? ""}`}
      data-size={size}
      data-full={fullWidth || undefined}
    >
      {data.map((each) => (
        <label key={each.value} className={style.segment}>
          <input
            type="radio"
            name={name}
            value={each.value}
            checked={each.value === value}
            disabled={disabled}
            onChange={() => onChange(each.value)}
          />
          <span>{each.label}</span>
        </label>
      ))}
    </div>
  );
}
