/** A field to search with. */
import { Icon } from "./icons";

interface SearchProps {
  /** What is searched, such as "Search services". */
  readonly label: string;
  readonly value: string;
  readonly onSearch: (search: string) => void;
  /** Is called with Enter. */
  readonly onEnter?: () => void;
}

export function SearchField({ label, value, onSearch, onEnter }: SearchProps) {
  const onKeyDown = (event: KeyboardEvent) => {
    if (event.key === "Enter") onEnter?.();
    if (event.key === "Escape") onSearch("");
  };
  return (
    <label class="search">
      <Icon name="search" />
      <input
        class="field"
        type="search"
        placeholder={label}
        aria-label={label}
        value={value}
        onInput={(event) => onSearch(event.currentTarget.value)}
        onKeyDown={onKeyDown}
      />
    </label>
  );
}
