/** Icons: drawings of 16 by 16, of lines in the colour of the text. */

const PATHS: Readonly<Record<string, string>> = {
  graph: "M2.5 5.5h4v5h-4zM9.5 2.5h4v4h-4zM9.5 9.5h4v4h-4zM6.5 7l3-2.2M6.5 9l3 2.2",
  plot: "M2.5 2.5v11h11M4.5 10.5l3-4 2.5 2.5 3.5-5",
  messages: "M2.5 3.5h11v7.5H8l-3 2.5V11H2.5zM5 6h6M5 8.5h4",
  frames: "M5 2.5v8.5h8.5M5 11l-3 3M3.2 4.3 5 2.5l1.8 1.8M11.7 9.2l1.8 1.8-1.8 1.8",
  parameters: "M2.5 4.5h6M11.5 4.5h2M2.5 11.5h2M7.5 11.5h6M10 3v3M6 10v3",
  log: "M3 3.5h10M3 6.5h7M3 9.5h10M3 12.5h5",
  services: "M2.5 6h9M9 3.5 11.5 6 9 8.5M13.5 10.5h-9M7 8 4.5 10.5 7 13",
  actions: "M3.5 13.5v-11h8l-1.8 3 1.8 3h-8",
  health: "M2 8.5h3l1.5-4 3 7.5 1.5-3.5h3",
  images: "M2.5 3.5h11v9h-11zM2.5 11l3.5-3.5 3 3 2-2 2.5 2.5M10.5 6.2v.1",
  teleop: "M8 2.5v11M2.5 8h11M6.2 4.3 8 2.5l1.8 1.8M6.2 11.7 8 13.5l1.8-1.8M4.3 6.2 2.5 8l1.8 1.8M11.7 6.2 13.5 8l-1.8 1.8",
  time: "M8 2.5a5.5 5.5 0 1 0 0 11 5.5 5.5 0 0 0 0-11zM8 5v3.2l2.2 1.3",
  add: "M8 3v10M3 8h10",
  close: "M4 4l8 8M12 4l-8 8",
  back: "M9.5 3.5 5 8l4.5 4.5",
  search: "M7 2.5a4.5 4.5 0 1 0 0 9 4.5 4.5 0 0 0 0-9zM10.3 10.3 13.5 13.5",
  fit: "M2.5 6v-3.5H6M10 2.5h3.5V6M13.5 10v3.5H10M6 13.5H2.5V10",
  plus: "M8 4v8M4 8h8",
  minus: "M4 8h8",
  light: "M8 5a3 3 0 1 0 0 6 3 3 0 0 0 0-6zM8 1.5v1.7M8 12.8v1.7M1.5 8h1.7M12.8 8h1.7M3.4 3.4l1.2 1.2M11.4 11.4l1.2 1.2M12.6 3.4l-1.2 1.2M4.6 11.4l-1.2 1.2",
  dark: "M13 9.5A5.5 5.5 0 0 1 6.5 3a5.5 5.5 0 1 0 6.5 6.5z",
  auto: "M8 2.5a5.5 5.5 0 1 0 0 11zM8 2.5a5.5 5.5 0 0 1 0 11",
  about: "M8 2.5a5.5 5.5 0 1 0 0 11 5.5 5.5 0 0 0 0-11zM8 7.5V11M8 5v.1",
};

export function Icon({ name }: { readonly name: string }) {
  return (
    <svg class="icon" viewBox="0 0 16 16" width="16" height="16" aria-hidden="true">
      <path d={PATHS[name] ?? PATHS.about} />
    </svg>
  );
}
