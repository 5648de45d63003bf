/** The Mantine theme, from the tokens of the design. */
import { type CSSVariablesResolver, createTheme, type MantineColorsTuple } from "@mantine/core";

const dark: MantineColorsTuple = [
  "#e8ebf1",
  "#a4adbd",
  "#8b95a7",
  "#5c6676",
  "#38404e",
  "#272d38",
  "#191d25",
  "#151920",
  "#12151b",
  "#0d1016",
];

const gray: MantineColorsTuple = [
  "#f6f7f9",
  "#eef0f4",
  "#e3e6eb",
  "#d6dae1",
  "#cfd4dc",
  "#a7afbd",
  "#6b7486",
  "#566073",
  "#333b4d",
  "#1b2130",
];

const small = { size: "sm" } as const;

export const theme = createTheme({
  colors: { dark, gray },
  black: "#1b2130",
  primaryColor: "indigo",
  primaryShade: { light: 8, dark: 4 },
  autoContrast: true,
  luminanceThreshold: 0.35,
  fontFamily: "var(--sans)",
  fontFamilyMonospace: "var(--mono)",
  fontSizes: {
    xs: "0.71875rem",
    sm: "0.8125rem",
    md: "0.875rem",
    lg: "1rem",
    xl: "1.25rem",
  },
  lineHeights: { xs: "1.4", sm: "1.45", md: "1.5", lg: "1.5", xl: "1.5" },
  headings: { fontWeight: "650" },
  spacing: { xs: "4px", sm: "8px", md: "12px", lg: "16px", xl: "24px" },
  radius: { xs: "4px", sm: "6px", md: "8px", lg: "12px", xl: "16px" },
  defaultRadius: "md",
  cursorType: "pointer",
  respectReducedMotion: true,
  focusRing: "auto",
  // Without the components themselves: each page would load all of them.
  components: {
    Button: { defaultProps: { ...small, variant: "default" } },
    ActionIcon: { defaultProps: { variant: "subtle", color: "gray" } },
    TextInput: { defaultProps: small },
    Textarea: { defaultProps: small },
    NativeSelect: { defaultProps: small },
    NumberInput: { defaultProps: small },
    Select: { defaultProps: { ...small, allowDeselect: false } },
    // A place to put the focus that is no item has no place in a menu.
    Menu: {
      defaultProps: {
        shadow: "md",
        position: "bottom-end",
        withInitialFocusPlaceholder: false,
        // A menu that fades after it was used would take the next tap.
        transitionProps: { duration: 100, exitDuration: 0 },
      },
    },
    Popover: { defaultProps: { shadow: "md" } },
    Notification: { defaultProps: { closeButtonProps: { "aria-label": "Close" } } },
    Modal: {
      defaultProps: { centered: true, radius: "lg", closeButtonProps: { "aria-label": "Close" } },
    },
    // The head of a dialog is a banner to browsers, and a page has one already.
    ModalHeader: { defaultProps: { role: "presentation" } },
    Tabs: { styles: { tab: { padding: "0.7rem 0.625rem 0.6rem" } } },
    // Its smallest text is 10 px, smaller than anything on a page may be.
    Kbd: { defaultProps: { size: "xs" }, styles: { root: { fontSize: 11 } } },
  },
});

const shared = {
  "--mantine-color-body": "var(--bg)",
  "--mantine-color-text": "var(--ink)",
  "--mantine-color-dimmed": "var(--ink2)",
  "--mantine-color-placeholder": "var(--ink3)",
  "--mantine-color-default": "var(--panel)",
  "--mantine-color-default-color": "var(--ink)",
  "--mantine-color-default-border": "var(--line2)",
  "--mantine-color-default-hover": "var(--hover)",
  "--mantine-color-anchor": "var(--accent)",
  "--mantine-color-error": "var(--error)",
  "--mantine-color-success": "var(--true)",
  "--mantine-shadow-md": "var(--shadow-high)",
};

export const variables: CSSVariablesResolver = () => ({
  variables: {},
  light: shared,
  dark: shared,
});
