// Light or dark as the page is, until somebody chooses otherwise here.
(() => {
  try {
    const page = localStorage.getItem("mantine-color-scheme-value");
    if (page && page !== localStorage.getItem("help.page-theme")) {
      localStorage.setItem("help.page-theme", page);
      localStorage.setItem("theme", page);
    }
  } catch {
    // A browser that keeps nothing shows what the system says.
  }
})();
