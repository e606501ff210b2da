/** Services panel: the services of the run, and for the chosen one a form made from its type. */
import type { OfferedService } from "../../connection/protocol";
import { counted } from "../../store/text";
import { matcher } from "../../store/search";
import { Check } from "../../controls/check";
import { Chooser } from "../../controls/chooser";
import { SearchField } from "../../controls/search_field";
import type { PanelProps } from "../panel";
import { CallForm } from "./call_form";

/** Services that every node has for its parameters and its log level. */
function isCommon(service: OfferedService): boolean {
  return service.type.startsWith("rcl_interfaces/srv/");
}

export function ServicesPanel({ session, settings, onSettings }: PanelProps) {
  const all = [...session.services.offered.value.values()];
  const showsCommon = settings.common === true;
  const search = typeof settings.search === "string" ? settings.search : "";
  const matches = matcher(search);
  const shown = all
    .filter((service) => (showsCommon || !isCommon(service)) && matches(service.name))
    .sort((one, other) => one.name.localeCompare(other.name));
  const chosen = all.find(({ name }) => name === settings.service) ?? (shown.length === 1 ? shown[0] : undefined);
  const hidden = all.filter(isCommon).length;
  return (
    <>
      <div class="toolbar">
        <SearchField label="Search services" value={search} onSearch={(text) => onSettings({ ...settings, search: text })} />
        {hidden > 0 && (
          <Check
            label={`Also ${counted(hidden, "parameter service")}`}
            on={showsCommon}
            onChange={(common) => onSettings({ ...settings, common })}
          />
        )}
      </div>
      <Chooser
        label="Services"
        choices={shown}
        chosen={chosen?.name}
        onChoose={(service) => onSettings({ ...settings, service })}
        empty={session.maySteer.value ? "No services" : "This page may only look: it calls no services."}
      >
        {chosen !== undefined && <CallForm key={`${chosen.name} ${chosen.id}`} session={session} service={chosen} />}
        {chosen === undefined && shown.length > 0 && <p class="empty">Choose a service to call it.</p>}
      </Chooser>
    </>
  );
}
